#!/usr/bin/env bash
# Make .venv with everything `make demo` (core) or `make test` (full: RL and developer tools too) needs.
#
#   scripts/bootstrap.sh [core|full]
#
# A second run only compares a stamp (well under a second). A run that was interrupted while it installed leaves
# .venv/.installing behind, and the next one starts over. PYTHON=/path/to/python3.12 chooses the interpreter.
set -euo pipefail
cd -P "$(dirname "${BASH_SOURCE[0]}")/.."

TIER="${1:-core}"
UV_VERSION=0.13.9
TORCH_VERSION=2.13.0
GL_PACKAGES="libegl1 libgl1 libgles2 libosmesa6"

say() { printf '== %s\n' "$*" >&2; }
die() { printf 'bootstrap: %s\n' "$*" >&2; exit 1; }

[[ "$TIER" == core || "$TIER" == full ]] || die "unknown tier '$TIER'; choose core or full"

exec 9<scripts/bootstrap.sh && flock 9  # two terminals at once: the second waits, then finds the stamp

# --- nothing to do? -----------------------------------------------------------------------------------------------
fingerprint() { cat pyproject.toml constraints.txt scripts/bootstrap.sh | sha256sum | cut -d' ' -f1; }
FINGERPRINT="$(fingerprint)"
stamped() { [[ -f ".venv/.stamp-$1" && "$(<".venv/.stamp-$1")" == "$FINGERPRINT $PWD" ]]; }
# Only whether a GL library is there at all: a stamp can come from another machine, with a cached .venv.
gl_library_present() { { ldconfig -p || /sbin/ldconfig -p; } 2>/dev/null | grep -qE 'lib(EGL|OSMesa)\.so'; }
packages_ready() { [[ ! -e .venv/.installing ]] && { stamped full || stamped "$TIER"; } && .venv/bin/python -c ''; }

if packages_ready 2>/dev/null && gl_library_present; then exit 0; fi

# --- Debian packages ----------------------------------------------------------------------------------------------
apt_install() {  # as root or with passwordless sudo; otherwise print the command and stop
    local reason="$1"; shift
    local install="apt-get install -y --no-install-recommends $*"
    command -v apt-get >/dev/null || die "$reason Install your system's equivalent of: $*"
    local sudo=""
    if [[ "$(id -u)" != 0 ]]; then
        if ! sudo -n true 2>/dev/null; then
            die "$reason Run this, then try again:  sudo apt-get update && sudo $install"
        fi
        sudo="sudo -n"
    fi
    say "$reason Installing $*"
    # A broken third-party source must not stop us if the package lists already know the packages.
    $sudo apt-get update -q >&2 || say "apt-get update failed; trying with the package lists at hand"
    $sudo env DEBIAN_FRONTEND=noninteractive $install >&2 || die "$reason This failed:  $install"
}

# --- Python -------------------------------------------------------------------------------------------------------
supported() { "$1" -c 'import sys; sys.exit(not (3, 10) <= sys.version_info[:2] <= (3, 12))' >/dev/null 2>&1; }

find_python() {
    local candidate
    if [[ -n "${PYTHON:-}" ]]; then
        supported "$PYTHON" || die "PYTHON=$PYTHON is not a working Python 3.10, 3.11 or 3.12"
        echo "$PYTHON"; return
    fi
    for candidate in python3 python3.12 python3.11 python3.10; do
        if supported "$candidate"; then echo "$candidate"; return; fi
    done
    die "no Python 3.10, 3.11 or 3.12 found (python3 is $(python3 --version 2>&1 || true)); set PYTHON=/path/to/one"
}

make_venv() {
    local python version
    python="$(find_python)"
    if ! "$python" -c 'import ensurepip, venv' >/dev/null 2>&1; then
        version="$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')"
        [[ "$python" == python3 ]] && version=3
        apt_install "$python cannot make virtual environments: python${version}-venv is missing." "python${version}-venv"
    fi
    say "making .venv with $("$python" --version)"
    "$python" -m venv --clear .venv
}

# A copied or moved folder brings scripts that name the old one, and an editable installation of it.
usable_venv() { supported .venv/bin/python && .venv/bin/python -m pip --version && grep -F "$PWD/.venv/" .venv/bin/pip; }

install_packages() {
    local extras="" python=.venv/bin/python
    if [[ -e .venv/.installing ]]; then
        say "the last installation was interrupted; starting over"
        make_venv
    elif ! usable_venv >/dev/null 2>&1; then
        make_venv
    fi
    touch .venv/.installing
    $python -m pip install --quiet "uv==$UV_VERSION" >&2
    if [[ "$TIER" == full ]]; then
        extras="[rl,export,ros,fetch,photoreal,cluster,dev]"
        # pip first, because it takes a CPU build of torch where one is configured (PIP_EXTRA_INDEX_URL, PIP_FIND_LINKS);
        # uv then keeps what it finds.
        say "installing torch $TORCH_VERSION (the CUDA build is large)"
        $python -m pip install --quiet -c constraints.txt "torch==$TORCH_VERSION" >&2
    fi
    say "installing fixation-gym$extras"
    # uv, because pip cannot override robosuite's requirements (see [tool.uv] in pyproject.toml).
    VIRTUAL_ENV="$PWD/.venv" .venv/bin/uv pip install --quiet -c constraints.txt -e ".$extras" >&2
    rm .venv/.installing
    echo "$FINGERPRINT $PWD" >".venv/.stamp-$TIER"
}

# --- go -----------------------------------------------------------------------------------------------------------
packages_ready 2>/dev/null || install_packages
if ! answer="$(.venv/bin/python -m fixation_gym.gl 2>&1)"; then
    # A choice of the user's that does not work is not for us to repair.
    [[ -z "${MUJOCO_GL:-}" ]] || die "$answer"
    apt_install "No GL library answers." $GL_PACKAGES
    answer="$(.venv/bin/python -m fixation_gym.gl 2>&1)" || die "$answer"
fi
say "ready (OpenGL by $answer)"
