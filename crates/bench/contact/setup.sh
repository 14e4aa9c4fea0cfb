#!/bin/sh
# Installs what contact solvers are measured beside, each on its own; what cannot be installed is told and left out.
#   Siconos: the Debian package of its numerics and a small program of ours over it (siconos/peer.c)
#   Pinocchio: the wheel "pin" in a virtual environment of its own
# usage: setup.sh FOLDER    (FOLDER gets siconos-peer and pinocchio/)
folder=${1:?usage: setup.sh FOLDER}
here=$(cd "$(dirname "$0")" && pwd)
python=${PYTHON:-python3}
mkdir -p "$folder"

header=siconos/numerics/SiconosNumerics.h
if [ ! -e "/usr/include/$header" ]; then
    packages="libsiconos-numerics-dev gcc libc6-dev"
    if [ "$(id -u)" = 0 ]; then as_root=""; else as_root="sudo -n"; fi
    $as_root apt-get update -qq
    $as_root apt-get install -y -qq --no-install-recommends $packages >/dev/null
fi
if [ ! -e "$folder/siconos-peer" ] || [ "$here/siconos/peer.c" -nt "$folder/siconos-peer" ]; then
    ${CC:-cc} -O2 -Wall -std=gnu11 -I/usr/include/siconos -I/usr/include/siconos/numerics \
        "$here/siconos/peer.c" -o "$folder/siconos-peer" -lsiconos_numerics -lm \
        || { rm -f "$folder/siconos-peer"; echo "Siconos: not available here; its columns stay empty"; }
fi

if [ ! -e "$folder/pinocchio/made" ]; then
    { "$python" -m venv "$folder/pinocchio" \
        && "$folder/pinocchio/bin/pip" install --quiet --disable-pip-version-check "pin==4.1.0" scipy \
        && touch "$folder/pinocchio/made"; } \
        || { rm -rf "$folder/pinocchio"; echo "Pinocchio: not available here; its columns stay empty"; }
fi
exit 0
