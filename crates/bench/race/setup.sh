#!/bin/sh
# Installs what the race needs beside Rust crates; what cannot be had is told loudly and left out.
#   MuJoCo and pymunk: wheels in a virtual environment of the race's own
#   Jolt: cmake, a C++ compiler, and libclang (the system's, or a wheel in that environment)
# usage: setup.sh FOLDER    (FOLDER gets race/ and race.env, which the build reads)
folder=${1:?usage: setup.sh FOLDER}
python=${PYTHON:-python3}
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
venv=$folder/race

loudly() { printf '\n*** %s ***\n\n' "$1" >&2; }

[ -x "$venv/bin/python" ] || "$python" -m venv "$venv" || loudly "no virtual environment: MuJoCo and pymunk do not race"
wheel() {
    [ -e "$venv/$1.made" ] && return 0
    "$venv/bin/python" -m pip install --quiet --disable-pip-version-check "$2" && touch "$venv/$1.made"
}
wheel mujoco 'mujoco==4.0.*' || loudly "SKIPPED MuJoCo: its wheel could not be installed"
wheel pymunk 'pymunk==7.3.*' || loudly "SKIPPED pymunk: its wheel could not be installed"

# where libclang is: what the user says, the system's newest, or a wheel
clang=${LIBCLANG_PATH:-}
if [ -z "$clang" ]; then
    for library in /usr/lib/llvm-*/lib/libclang.so* /usr/lib/*/libclang*.so*; do
        case $library in *libclang-cpp*) continue ;; esac
        [ -e "$library" ] && clang=$(dirname "$library")
    done
fi
if [ -z "$clang" ] && wheel libclang 'libclang==18.*'; then
    clang=$(echo "$venv"/lib/python*/site-packages/clang/native)
fi
missing=""
command -v cmake >/dev/null || missing="$missing cmake"
command -v "${CXX:-c++}" >/dev/null || missing="$missing a C++ compiler"
[ -n "$clang" ] || missing="$missing libclang"
if [ -z "$missing" ]; then
    # a wheel's libclang has no headers of its own: those of the C compiler serve
    headers=$("${CC:-cc}" -print-file-name=include)
    {
        echo "export RACE_FEATURES=jolt"
        echo "export LIBCLANG_PATH='$clang'"
        echo "export BINDGEN_EXTRA_CLANG_ARGS='-isystem $headers'"
    } >"$folder/race.env"
else
    loudly "SKIPPED Jolt: missing$missing"
    echo "export RACE_FEATURES=" >"$folder/race.env"
fi
exit 0
