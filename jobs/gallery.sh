#!/bin/bash
# A picture of every template: docs/figures/gallery-NAME.png. Run from the project's folder after `make build`.
# Prints the seconds that each run took and the processor time of its ranks.
set -eu
TIMEFORMAT='%R s, processors %U + %S s'
program=${PROGRAM:-target/release/mpm-par}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
draw() { # template, field
    echo "$1"
    time sh jobs/mpirun.sh 2 "$program" "src/deck/templates/$1.toml" --out "$folder/$1" --quiet
    "$program" plot "$folder/$1" --field "$2" -o "docs/figures/gallery-$1.png"
}
draw beam von_mises
draw slope plastic_strain
draw footing plastic_strain
draw excavation "|displacement|"
draw cone plastic_strain
draw column-collapse plastic_strain
draw collision von_mises
echo triaxial
time sh jobs/mpirun.sh 1 "$program" src/deck/templates/triaxial.toml --out "$folder/triaxial" --quiet
"$program" plot "$folder/triaxial" --table element --columns q,p --x strain_1 -o docs/figures/gallery-triaxial.png
