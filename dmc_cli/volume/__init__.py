"""The volume and its readers; `read.py` is the one way in. Nothing here imports Warp."""
