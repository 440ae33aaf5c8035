#!/bin/sh
# The Windows program as a program of this system: the command-line tests run it through wine.
#   ECAUDIT_EXE     ecaudit.exe
exec "${ECAUDIT_WINE:-/usr/lib/wine/wine64}" "$ECAUDIT_EXE" "$@"
