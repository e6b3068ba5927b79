"""The volume: values on a grid and where they lie in the world. Nothing here imports Warp."""
