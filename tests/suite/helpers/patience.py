"""How long tests wait for what is sure to come."""

PATIENCE = 600.0
"""For a thread, a process or a reply: so long that only one that never comes is missed [s]."""
