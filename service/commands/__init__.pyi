from .cli import run_command_line as run_command_line
