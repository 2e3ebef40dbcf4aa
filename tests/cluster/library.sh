#!/usr/bin/env bash
# A library of 1000 models, ten formulas with varied parameters, converted in one batch that is
# killed in the middle: models a second, memory of the batch, no model lost and none done twice.
# usage: tests/cluster/library.sh ISOSPLINE FOLDER
set -euo pipefail
isospline=$(realpath "$1")
folder=$2
models=${MODELS:-1000}
mkdir -p "$folder/library"
cd "$folder"

formulas=(
  'x^2 + y^2 + z^2 - 0.5*a'
  'x^2/a + y^2 + z^2 - 0.8'
  '(sqrt(x^2 + y^2) - 0.8)^2 + z^2 - 0.05*a'
  'x^4 + y^4 + z^4 - 0.6*a'
  '(x^2 + y^2 + z^2)^2 - 0.9*(x^2 - y^2) - 0.1*a'
  'smin((x - 0.5)^2 + y^2 + z^2 - 0.3*a, (x + 0.5)^2 + y^2 + z^2 - 0.3, 0.3)'
  'x^2 + y^2 + z^2 - 0.8 + 0.1*a*sin(3*x)*sin(3*y)*sin(3*z)'
  'smax(x^2 + y^2 + z^2 - 1, 0.3*a - x^2 - y^2, 0.3)'
  'min((x - 0.7)^2 + y^2 + z^2 - 0.2*a, (x + 0.7)^2 + y^2 + z^2 - 0.1)'
  'x^2 + y^2 - a*z^2*(1 - z^2)'
)
for ((k = 0; k < models; k++)); do
  a=$(awk -v k="$k" 'BEGIN { printf "%.4f", 0.8 + 0.004 * int(k / 10) }')
  printf '[model]\nformula = "%s"\nbox = [[-1.6, 1.6], [-1.6, 1.6], [-1.6, 1.6]]\nparameters = { a = %s }\n[target]\nfaces = 200\nfit = "paper"\n' \
    "${formulas[k % 10]}" "$a" > "$(printf 'library/f%d_%04d.toml' $((k % 10)) "$k")"
done

batch=("$isospline" batch library --out out --no-sync)
lines() { if [ -f out/summary.jsonl ]; then wc -l < out/summary.jsonl; else echo 0; fi; }
begin=$(date +%s%N)
"${batch[@]}" 2>> log.txt &
pid=$!
while [ "$(lines)" -lt $((models / 2)) ] && kill -0 $pid 2>/dev/null; do sleep 0.05; done
peak=$(awk '/VmHWM/ { print $2 }' "/proc/$pid/status")
kill -9 $pid
wait $pid || true
kept=$(lines)
code=0
"${batch[@]}" --json > second.jsonl 2>> log.txt || code=$?
end=$(date +%s%N)

again=$(wc -l < second.jsonl)
names=$(sed 's/^{"model":"\([^"]*\)".*/\1/' out/summary.jsonl | sort -u | wc -l)
echo "killed after $kept models; then $again were done; exit code $code"
echo "$(lines) lines of $names models"
echo "models a second: $(awk -v n="$models" -v ns=$((end - begin)) 'BEGIN { printf "%.2f", n / (ns / 1e9) }')"
echo "peak memory of the batch: $peak kB"
awk -F'"outcome":"' '{ split($2, a, "\""); n[a[1]]++ } END { for (o in n) print o, n[o] }' out/summary.jsonl | sort
[ "$names" -eq "$models" ] && [ "$(lines)" -eq "$models" ] && [ $((kept + again)) -eq "$models" ]
# The tenth formula is a cone at the origin, whatever its parameter is.
[ "$code" -eq 3 ]
