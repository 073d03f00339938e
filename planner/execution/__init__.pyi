from .equilibrium import Equilibria as Equilibria, LimbPull as LimbPull, equilibria as equilibria
from .open_loop import execute as execute, find_open_loop as find_open_loop
