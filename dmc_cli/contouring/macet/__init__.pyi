# What others use of this folder: `methods.py` has the place of the declaration, which has that of the rest.

from .declaration import METHOD as METHOD
