from .finishing.candidate import Outcome as Outcome
from .finishing.candidate import outcomes as outcomes
from .problem.problem import Problem as Problem
from .problem.target import problem_of as problem_of
from .results.identify import Identification as Identification
from .results.identify import identify as identify
from .solvers.pool_search import PoolState as PoolState
from .solvers.pool_search import solve as solve
