"""`python -m romc`: the command line."""

from romc._command import main

main()
