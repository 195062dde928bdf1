# Sourced by run.sh and test.sh: installs what is missing, finds the data, configures and builds.
# The lists of packages stand here and nowhere else.

# What the build and the default study need.
base_packages=(
    g++ cmake ninja-build pkg-config git ca-certificates
    libeigen3-dev libfmt-dev nlohmann-json3-dev libcli11-dev libboost-dev libhwy-dev zlib1g-dev libsqlite3-dev
    libfcl-dev libccd-dev libode-dev
    libgtest-dev libbenchmark-dev
)
# The Python module (./run.sh --python, ./test.sh).
python_packages=(pybind11-dev python3-dev python3-numpy python3-pandas)
# Optional baselines (./run.sh --baselines): several hundred megabytes, no default figure needs them.
baseline_packages=(libembree-dev libbullet-dev libcgal-dev)
# ./run.sh docs
docs_packages=(mkdocs mkdocs-material)
# Checks beyond the tests.
check_packages=(clang-format-14 clang-tidy-14)
# ./test.sh fuzz; llvm-16 names the places of a find
fuzz_packages=(clang-16 libclang-rt-16-dev llvm-16 python3)
# ./test.sh full; those behind the compiler read what trocar writes for others: VTK the exports, LaTeX the tables, R and
# pandas the CSV, compare.py the times; a browser opens the pages, Slurm runs a study in shards, Jupyter the notebook, mypy
# reads the type stubs
full_packages=(
    "${fuzz_packages[@]}" "${python_packages[@]}"
    python3-vtk9 texlive-latex-base texlive-latex-recommended r-base-core
    libbenchmark-tools python3-scipy
    python3-nbclient python3-ipykernel python3-cloudpickle python3-matplotlib mypy
    chromium chromium-driver
    slurmctld slurmd slurm-client munge
)

say() { printf '\n== %s\n' "$*"; }

install_missing() {
    local missing=() package
    for package in "$@"; do
        dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'install ok installed' || missing+=("$package")
    done
    [ ${#missing[@]} -eq 0 ] && return 0
    say "installing ${missing[*]}"
    local sudo=()
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null || { echo "these packages need root or sudo: ${missing[*]}" >&2; exit 2; }
        sudo=(sudo)
    fi
    "${sudo[@]}" apt-get update -qq
    "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
}

# Data outside the project: --data, else $TROCAR_DATA, else the folder beside the project if there is one.
find_data() {
    if [ -z "${TROCAR_DATA:-}" ] && [ -d ../shared/data ]; then
        TROCAR_DATA=$(cd ../shared/data && pwd)
        export TROCAR_DATA
    fi
}

# Where a preset builds (CMakePresets.json).
folder_of() {
    case $1 in bare) echo build/release ;; *) echo "build/$1" ;; esac
}

# configure PRESET [cmake arguments]
configure() {
    local preset=$1 folder
    folder=$(folder_of "$1")
    shift
    say "configuring $preset"
    mkdir -p "$folder"
    # A compiler cache cannot share what precompiled headers are in, and files compiled together are seldom the same.
    [ -n "${CMAKE_CXX_COMPILER_LAUNCHER:-}" ] || set -- -DTROCAR_PRECOMPILED=ON -DTROCAR_UNITY=ON "$@"
    cmake --preset "$preset" "$@" >"$folder/configure.log" 2>&1 || { cat "$folder/configure.log" >&2; exit 1; }
    grep -E '^-- trocar:' "$folder/configure.log" || true
}

# build PRESET [targets]
build() {
    local preset=$1 folder
    folder=$(folder_of "$1")
    shift
    say "building $preset"
    local arguments=() started=$SECONDS
    [ $# -gt 0 ] && arguments=(--target "$@")
    if [ -t 1 ]; then
        cmake --build --preset "$preset" "${arguments[@]}"
    else
        # Nobody is left alone with a silent build: a line a minute with ninja's count of steps.
        : >"$folder/build.log"
        (
            trap 'kill "$pause" 2>/dev/null; exit 0' TERM
            while true; do
                sleep 60 & pause=$!
                wait "$pause"
                echo "$preset: $((SECONDS - started)) s $(grep -oE '^\[[0-9]+/[0-9]+\]' "$folder/build.log" | tail -n 1)"
            done
        ) &
        local reporting=$! status=0
        cmake --build --preset "$preset" "${arguments[@]}" >"$folder/build.log" 2>&1 || status=$?
        kill "$reporting" 2>/dev/null || true
        wait "$reporting" 2>/dev/null || true
        [ "$status" -eq 0 ] ||
            { grep -vE '^\[[0-9]+/[0-9]+\] (Building|Linking)' "$folder/build.log" | tail -n 100 >&2; exit 1; }
    fi
}
