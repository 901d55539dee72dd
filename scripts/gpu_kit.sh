#!/usr/bin/env bash
# Runs isograd's GPU tests and benchmarks on this machine and writes the results to one JSON file:
#
#     ./run.sh [RESULT.json]
#
# Needs Linux on x86-64 and an NVIDIA driver; no compiler, no CUDA toolkit, no network. Where compute-sanitizer is
# installed it checks memory accesses and races on small cases; where python3 has NumPy the wheel is tried, with PyTorch and
# JAX where they are there.
#
# Exit status: 0 everything passed, 1 something failed, 3 there is no NVIDIA device.
set -uo pipefail

result=$(realpath -m "${1:-gpu-result.json}")
cd "$(dirname "$(realpath "$0")")" || exit 1
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
export CUDA_PATH=$PWD/cuda
export LD_LIBRARY_PATH=$CUDA_PATH/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}

no_device() {
    echo "error: no NVIDIA device: $1" >&2
    exit 3
}

card() { nvidia-smi --query-gpu="$1" --format=csv,noheader 2>/dev/null | head -1 | tr -d '"\\'; }

echo "── device"
compgen -G "/dev/nvidia[0-9]*" >/dev/null || [ -e /dev/dxg ] || no_device "neither /dev/nvidia0 nor /dev/dxg exists"
echo "$(card name), driver $(card driver_version)"

echo "── conformance"
bin/conformance --show-output >"$work/conformance" 2>&1
status=$?
if reason=$(grep -m 1 "SKIPPED on CUDA" "$work/conformance"); then
    no_device "$reason"
fi
grep -E "FAILED|panicked|^test result" "$work/conformance"
# Null if the tests ended early.
count() { grep "^test result" "$work/conformance" | grep -oE "[0-9]+ $1" | grep -oE "[0-9]+" || echo null; }
conformance="{\"passed\": $(count passed), \"failed\": $(count failed)}"
[ $status = 0 ] || cp "$work/conformance" "$result.conformance.log"

echo "── compute-sanitizer"
sanitizer=absent
if command -v compute-sanitizer >/dev/null; then
    sanitizer=passed
    for test in "memcheck splat" "memcheck distance_is_that_of_the_cpu" "racecheck distance_is_that_of_the_cpu"; do
        read -r tool name <<<"$test"
        # Exit status 9 for any invalid access or race.
        if ! compute-sanitizer --tool "$tool" --error-exitcode 9 bin/conformance "$name" --test-threads 1 \
            >"$work/sanitizer" 2>&1; then
            sanitizer=failed status=1
            cp "$work/sanitizer" "$result.$tool.$name.log"
        fi
    done
fi
echo "$sanitizer"

echo "── wheel"
wheel=absent
if python3 -c "import numpy" 2>/dev/null && python3 -m pip --version >/dev/null 2>&1; then
    wheel=passed
    python3 -m pip install --quiet --no-index --no-deps --target "$work/site" ./*.whl &&
        PYTHONPATH=$work/site python3 try_wheel.py || { wheel=failed status=1; }
fi
echo "$wheel"

echo "── benchmark"
if ! bin/gpu-times "$work/benchmark"; then
    echo null >"$work/benchmark"
    status=1
fi

cat >"$result" <<END
{
"device": "$(card name)",
"driver": "$(card driver_version)",
"conformance": $conformance,
"sanitizer": "$sanitizer",
"wheel": "$wheel",
"benchmark": $(cat "$work/benchmark")
}
END
echo "wrote $result; in a checkout, \`cargo xtask gpu --page $(basename "$result")\` makes docs/gpu.md from it"
[ $status = 0 ]
