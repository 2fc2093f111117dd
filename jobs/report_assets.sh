#!/bin/bash
# Makes the libraries of report.html from npm: src/output/report/assets/uPlot.* and ogl.*. Needs node, npm and the network;
# a build of the program needs none of them, as the results are part of the sources.
# usage: jobs/report_assets.sh            (UPLOT=1.6.32 OGL=1.0.11 ESBUILD=0.28.2: versions)
set -eu
assets=$(cd "$(dirname "$0")/.." && pwd)/src/output/report/assets
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm init -y >/dev/null
npm install --no-audit --no-fund --silent "uplot@${UPLOT:-1.6.32}" "ogl@${OGL:-1.0.11}" "esbuild@${ESBUILD:-0.28.2}"
cp node_modules/uplot/dist/uPlot.iife.min.js node_modules/uplot/dist/uPlot.min.css "$assets"
cp node_modules/uplot/LICENSE "$assets/uPlot.LICENSE"
# Of OGL the parts that the page uses.
echo 'export { Renderer, Program, Mesh, Geometry } from "ogl";' >parts.js
node_modules/.bin/esbuild parts.js --bundle --minify --format=iife --global-name=OGL \
    --legal-comments=none --outfile="$assets/ogl.iife.min.js"
cat >"$assets/ogl.LICENSE" <<LICENCE
OGL ${OGL:-1.0.11}, https://github.com/oframe/ogl
This is free and unencumbered software released into the public domain.
For more information, please refer to <https://unlicense.org>
LICENCE
