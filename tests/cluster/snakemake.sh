#!/usr/bin/env bash
# Runs an emitted Snakefile and compares the outcomes with those of a plain batch.
# usage: tests/cluster/snakemake.sh ISOSPLINE FOLDER
set -euo pipefail
isospline=$(realpath "$1")
mkdir -p "$2/library"
cd "$2"
command -v snakemake >/dev/null || { echo "skipped: no snakemake"; exit 0; }
printf '[model]\nformula = "x^2+y^2+z^2-1"\nbox = [[-1.5,1.5],[-1.5,1.5],[-1.5,1.5]]\n' > library/ball.toml
printf '[model]\nformula = "x^2+y^2-z^2*(1-z^2)"\nbox = [[-1.5,1.5],[-1.5,1.5],[-1.5,1.5]]\n' > library/cone.toml
set_all=(--set target.fit=paper --set target.faces=200)
"$isospline" batch library --out out "${set_all[@]}" --emit snakemake
snakemake --snakefile out/Snakefile --cores 2 --quiet all
# Nothing is left to do.
snakemake --snakefile out/Snakefile --cores 2 --dry-run | grep -q "Nothing to be done"
"$isospline" batch library --out plain "${set_all[@]}" --json > /dev/null 2>&1 || true
outcomes() { sed 's/.*"model":"\([^"]*\)","outcome":"\([^"]*\)","reason":"\([^"]*\)".*/\1 \2 \3/' "$1/summary.jsonl" | sort; }
diff <(outcomes out) <(outcomes plain)
echo "the Snakefile did what the batch does"
