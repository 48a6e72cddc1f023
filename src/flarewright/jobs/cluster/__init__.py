"""Work off lists of items by the workers of a Dask cluster; only these modules know Dask, and import it when they run.

Upper modules use lower ones:

- `executor`: `open_cluster` and `Cluster`, which works off a list as `processes.work_off` does
- `connections`: a client of a local cluster, of a running scheduler, or of SLURM jobs
- `local_workers`: worker processes of this machine
- `checks`: compares versions and folders of the workers with those here
- `worker_side`: what runs on a worker: its versions, an item, and the loop of a local worker
- `quiet`: keeps Dask's log and warnings from stderr
- `slurm_file`: `SlurmSettings` and their TOML file
- `choice`: `parse_cluster`, the words of `--cluster`
"""
