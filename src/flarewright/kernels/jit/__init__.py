"""Compilation of kernels: decorators, Numba's compiler and cache, and the helper processes of a first run.

Kernels use `decorators` and `simd`; the command line and the renderer use `warmup` and `warmup_processes`. `type_memo`,
`pipeline`, `linking`, `cache_loading` and `cache_files` patch Numba; under an unsupported Numba version the package
works without them.

- `decorators`: `compiled`, `inner`, `borrowing`, `inlined` for kernels; `for_python` for tests
- `warmup`: `compile_together` compiles the roots of a command in several processes; `absent`
- `roots`: the table of roots, `roots.json`, and its division over processes: `needed`, `divide_roots`
- `warmup_processes`: helper processes: `head_start`, `cores`
- `compile_progress`: progress of a first run: `schedule`, `reporting`
- `cache_stamp`: invalidates cached kernels when any kernel's source changes
- `cache_files`: files of compiled kernels with digests; a damaged file or a full disk does not end a run
- `cache_loading`: loads cached kernels without Numba's function library
- `pipeline`: `KernelCompiler`, Numba's compiler with fewer passes
- `linking`: `InnerCompiler`, links inner kernels into their callers
- `type_memo`: memoised typing, live variables on access and inlining without copies during compilation
- `simd`: vector intrinsics that LLVM does not find by itself
"""
