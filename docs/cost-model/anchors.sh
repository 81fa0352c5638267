#!/bin/bash
# Synthesises the single operators that the cost model's laws are fitted to, and prints a line each:
#   operator, technology, cell area (um2), NAND2 equivalents, longest path (ns)      ECP5: operator, LUTs, DSPs, memory blocks
#
#   apt-get install yosys opensta qflow-tech-osu035 qflow-tech-osu018        Debian 12: yosys 0.23, OpenSTA 2019-11
#   docs/cost-model/anchors.sh                    all of them, about 10 minutes
#   docs/cost-model/anchors.sh add24 mul24        these
#
# Standard cells: yosys synth, mapped by abc for delay, with buffers and sizes; OpenSTA from inputs (no slew) to outputs
# (no load), typical corner. No placement, no wires. Each circuit is combinational; `regs` is an array of registers.
set -u
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

verilog() { # name -> module m
  local kind=${1%%[0-9]*} n=${1##*[a-z]}
  local w=$((n - 1)) p=$((2 * n - 1))
  case $kind in
    add) echo "module m(input [$w:0] a,b, output [$w:0] y); assign y = a + b; endmodule" ;;
    addsub) echo "module m(input s, input [$w:0] a,b, output [$w:0] y); assign y = a + (b ^ {$n{s}}) + s; endmodule" ;;
    csa) echo "module m(input [$w:0] a,b,c, output [$w:0] s,k); assign s = a^b^c; assign k = (a&b)|(c&(a^b)); endmodule" ;;
    less) echo "module m(input [$w:0] a,b, output y); assign y = a < b; endmodule" ;;
    equal) echo "module m(input [$w:0] a,b, output y); assign y = a == b; endmodule" ;;
    any) echo "module m(input [$w:0] a, output y); assign y = |a; endmodule" ;;
    abs) echo "module m(input [$w:0] a, output [$w:0] y); assign y = a[$w] ? -a : a; endmodule" ;;
    mux) echo "module m(input [1:0] s, input [$w:0] a,b,c,d, output [$w:0] y); assign y = s[1] ? (s[0] ? d : c) : (s[0] ? b : a); endmodule" ;;
    shift) echo "module m(input [5:0] s, input [$w:0] a, output [$w:0] y); assign y = a << s; endmodule" ;;
    mul) echo "module m(input [$w:0] a,b, output [$p:0] y); assign y = a * b; endmodule" ;;
    smul) echo "module m(input signed [$w:0] a,b, output signed [$p:0] y); assign y = a * b; endmodule" ;;
    cross) echo "module m(input signed [$w:0] a,b,c,d, output signed [$p:0] y); assign y = a * b - c * d; endmodule" ;;
    dot) echo "module m(input signed [$w:0] a,b,c,d,e,f, output signed [$((p + 2)):0] y); assign y = a * b + c * d + e * f; endmodule" ;;
    regs) echo "module m(input clk, we, input [2:0] wa, ra, input [$w:0] d, output [$w:0] q); reg [$w:0] r [0:7];
      always @(posedge clk) if (we) r[wa] <= d; assign q = r[ra]; endmodule" ;;
    ram) echo "module m(input clk, we, input [8:0] wa, ra, input [$w:0] d, output reg [$w:0] q); reg [$w:0] r [0:511];
      always @(posedge clk) begin if (we) r[wa] <= d; q <= r[ra]; end endmodule" ;;
    *) echo "unknown operator $1" >&2; exit 2 ;;
  esac
}

cells() { # name technology
  local lib=/usr/share/qflow/tech/$2/$2_stdcells.lib net=$work/$1.$2.v
  yosys -q -p "read_verilog $work/$1.v; synth -flatten -top m; memory_map; dfflibmap -liberty $lib; opt;
    abc -liberty $lib -script +strash;dch;map,-B,0.9;topo;buffer,-c;upsize;dnsize; opt_clean -purge;
    tee -o $work/stat stat -liberty $lib; write_verilog -noattr $net" >"$work/log" 2>&1 || { cat "$work/log" >&2; return 1; }
  printf '%s\n' "read_liberty $lib" "read_verilog $net" "link_design m" "create_clock -name c -period 1000 [get_ports -quiet clk]" \
    "set_input_delay 0 -clock c [all_inputs]" "set_output_delay 0 -clock c [all_outputs]" \
    "report_checks -path_delay max" exit >"$work/sta.tcl"
  sta -no_splash -exit "$work/sta.tcl" >"$work/sta" 2>&1
  local area delay gate=96
  area=$(awk '/Chip area/ {print $NF}' "$work/stat")
  delay=$(awk '/data arrival time/ {print $1; exit}' "$work/sta")
  [ "$2" = osu018 ] && gate=24
  awk -v n="$1" -v t="$2" -v a="$area" -v d="$delay" -v g="$gate" 'BEGIN {printf "%s\t%s\t%.0f\t%.1f\t%s\n", n, t, a, a / g, d}'
}

ecp5() { # name
  yosys -q -p "read_verilog $work/$1.v; synth_ecp5 -top m; tee -o $work/stat stat" >"$work/log" 2>&1 || { cat "$work/log" >&2; return 1; }
  awk -v n="$1" '/LUT4/ {l += $2} /CCU2C/ {l += 2 * $2} /TRELLIS_DPR16X4/ {l += 4 * $2} /MULT18X18D/ {m += $2} /DP16KD/ {b += $2} /TRELLIS_FF/ {f += $2}
    END {printf "%s\tecp5\tLUTs %d\tDSPs %d\tblocks %d\tFFs %d\n", n, l, m, b, f}' "$work/stat"
}

all="add8 add16 add24 add32 add48 add64 add80 addsub32 addsub80 csa24 less8 less24 less56 less80 equal24 any64 abs26 abs80 mux32
  shift54 mul8 mul12 mul16 mul20 mul24 mul28 mul32 smul26 cross26 dot26 regs32"
for name in ${*:-$all ram36}; do
  verilog "$name" >"$work/$name.v" || exit
  case $name in ram*) ;; *) cells "$name" osu035; cells "$name" osu018 ;; esac
  ecp5 "$name"
done
