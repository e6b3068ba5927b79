"""Place a polygon's vertex in its cell.

exact         on the trilinear surface: what all of the next two do
exact_simd    sixteen vertices at a time, on CPU
exact_scalar  those that remain, and all on a GPU, one by one
sampled       as the code of the paper of 2021
iterative     as the code of the paper of 2020
paper         vertices of all cells by one of those two
"""
