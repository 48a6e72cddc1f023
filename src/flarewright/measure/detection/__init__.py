"""Detects ghosts in views without known positions.

`matching_pursuit.pursue` repeats a cycle over all views of a run: vote for candidates (`rim_voting`, `blobs`,
`crescents`), fit the best ones, subtract them and vote again. Later steps split and join the detected ghosts.

- `blobs`: votes for ghosts a few pixels wide (`blobs`)
- `channel_mix`: mixes the colours of a view with least noise (`channel_weights`, `mix_channels`, `mixture`)
- `crescents`: votes for ghosts that shrink and slow down off axis (`crescents`)
- `join_ghosts`: joins two detected ghosts that one ghost explains as well (`join_ghosts`)
- `matching_pursuit`: search for all ghosts of a run (`pursue`)
- `rim_voting`: votes for round and polygonal borders (`slopes_of`, `candidates`, `RimCandidate`)
- `settings`: settings of all these steps (`DetectionSettings`)
- `single_image`: ghosts of one picture as discs (`spots_of_picture`, `spots_of_model`)
- `split_ghosts`: splits a detected ghost that covers two (`split_ghosts`)
- `user_hints`: ghosts that the user added or removed (`candidate`, `report_marks`, `without_removed`)
"""
