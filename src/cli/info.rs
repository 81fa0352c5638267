//! `radeng info`: a scene or a board, resolved, with sizes and memory.

use std::fmt::Write as _;
use std::path::Path;

use rtl_model::cost::{Cost, FpgaUse, Technology};
use rtl_model::spec::BoardSpec;

use super::args::InfoArgs;
use super::plan::DEFAULT_BOARD;
use super::{CliError, Outcome, plan};
use crate::frame::{self, Inspected};
use crate::mesh::Mesh;
use crate::radiosity::SolveOptions;
use crate::radiosity::memory::HostMemory;
use crate::report::si::{bytes, si, vector};
use crate::scene::{FaceCounts, MeshTarget, Scene, Shape};
use crate::units::Rgb;

/// The technology of costs when none is named.
const DEFAULT_TECHNOLOGY: &str = "osu-0.35um";

/// Top-level keys that only scene files have.
const SCENE_KEYS: [&str; 7] = ["version", "camera", "materials", "surface", "mesh", "light", "meshing"];

pub(super) fn run(args: &InfoArgs) -> Result<Outcome, CliError> {
    if let Some(name) = args.what.to_str().filter(|_| is_board(&args.what)) {
        let spec = plan::resolve_board(name)?;
        let technology = args.technology.as_deref().unwrap_or(DEFAULT_TECHNOLOGY);
        let costs = Technology::named(technology).map(|t| cost_text(&Cost::of(&spec, t), &spec));
        let text = board_text(&spec) + &costs.unwrap_or_default();
        return Ok(Outcome { text, ..Outcome::default() });
    }
    if args.technology.is_some() {
        let message = format!("--technology: {} is a scene; only boards have costs", args.what.display());
        return Err(CliError::Usage(message));
    }
    if !args.what.exists() {
        return Err(CliError::Usage(format!("{}: {}", args.what.display(), plan::no_file_no_preset())));
    }
    let board = plan::resolve_board(DEFAULT_BOARD)?;
    let inspected = frame::inspect_scene(&args.what, args.elements, &board)?;
    Ok(Outcome { text: scene_text(&inspected), warnings: inspected.warnings, ..Outcome::default() })
}

/// A preset's name, or a TOML file without any key of a scene. Everything else is a scene, or an error as a scene.
fn is_board(what: &Path) -> bool {
    if !what.exists() {
        return what.to_str().is_some_and(|name| BoardSpec::preset_names().contains(&name));
    }
    if Scene::is_model_file(what) {
        return false;
    }
    let table = std::fs::read_to_string(what).ok().and_then(|text| text.parse::<toml::Table>().ok());
    table.is_some_and(|t| !t.is_empty() && !SCENE_KEYS.iter().any(|key| t.contains_key(*key)))
}

fn board_text(spec: &BoardSpec) -> String {
    let parameters = spec.parameters();
    let name = parameters.iter().map(|p| p.name.len()).max().unwrap_or(0).max("parameter".len());
    let value = parameters.iter().map(|p| p.value.len()).max().unwrap_or(0).max("value".len());
    let mut out = format!("board {}\n\n{:<name$}  {:<value$}  source\n", spec.name, "parameter", "value");
    for p in &parameters {
        let _ = writeln!(out, "{:<name$}  {:<value$}  {}", p.name, p.value, p.source);
    }
    derived(&mut out, spec);
    let divider = spec.divider();
    if let Some(unit) = &divider {
        let icu = spec.icu_timing();
        let _ = writeln!(
            out,
            "\ndivision: latency {} cycles, initiation interval {} cycles; \
             the ICU with it: depth {} cycles, initiation interval {} cycles",
            unit.latency_cycles(),
            unit.initiation_interval_cycles(),
            icu.depth,
            icu.initiation_interval
        );
    }
    let mut wires = spec.formats.width_table();
    wires.extend(divider.iter().flat_map(|unit| unit.width_table()));
    let wire = wires.iter().map(|w| w.wire.len()).max().unwrap_or(0).max("wire".len());
    let _ = writeln!(out, "\n{:<wire$}  {:>4}  {:>8}  largest magnitude", "wire", "bits", "fraction");
    for w in &wires {
        let _ = writeln!(out, "{:<wire$}  {:>4}  {:>8}  {}", w.wire, w.bits, w.frac_bits, w.max_magnitude);
    }
    out
}

/// Gates, registers, memory, area and longest path by kind of block, and of the board.
fn cost_text(cost: &Cost, spec: &BoardSpec) -> String {
    let size = |area: Option<f64>, fpga: Option<FpgaUse>| match (area, fpga) {
        (Some(area), _) => [format!("{area:.2}"), String::new(), String::new()],
        (None, Some(f)) => [f.luts.to_string(), f.dsps.to_string(), f.ram_blocks.to_string()],
        (None, None) => Default::default(),
    };
    let heads = if cost.fpga.is_some() { ["LUTs", "DSPs", "blocks"] } else { ["mm2", "", ""] };
    let mut out = format!(
        "\ncosts in {}, the DRAM's chips and bus drivers left out (docs/cost-model.md)\n\n",
        cost.technology
    );
    let mut row = |name: &str, count: &str, figures: [String; 3], size: [String; 3], path: [String; 2]| {
        let [gates, flip_flops, ram_bits] = figures;
        let [a, b, c] = size;
        let [ns, through] = path;
        let fpga = if cost.fpga.is_some() { format!(" {b:>5} {c:>6}") } else { String::new() };
        let line = format!(
            "{name:<16} {count:>5} {gates:>10} {flip_flops:>10} {ram_bits:>9} {a:>9}{fpga} {ns:>7}  {through}"
        );
        let _ = writeln!(out, "{}", line.trim_end());
    };
    let words = |w: [&str; 3]| w.map(str::to_owned);
    row(
        "block",
        "count",
        words(["gates", "flip-flops", "RAM bits"]),
        words(heads),
        ["ns".to_owned(), "longest path".to_owned()],
    );
    for b in &cost.blocks {
        row(
            b.block,
            &b.instances.to_string(),
            [format!("{:.0}", b.gates), b.flip_flops.to_string(), b.ram_bits.to_string()],
            size(b.area_mm2, b.fpga),
            [format!("{:.2}", b.path_ns), b.path.clone()],
        );
    }
    row(
        "board",
        "",
        [format!("{:.0}", cost.gates), cost.flip_flops.to_string(), cost.ram_bits.to_string()],
        size(cost.area_mm2, cost.fpga),
        [format!("{:.2}", cost.critical_path_ns), format!("in {}", cost.critical_block)],
    );
    let fits = if spec.clock_mhz <= cost.max_clock_mhz { "within" } else { "beyond" };
    let _ = writeln!(
        out,
        "\nfastest clock {:.1} MHz; the board's {} MHz is {fits} it. At rest {}",
        cost.max_clock_mhz,
        spec.clock_mhz,
        si(cost.leakage_w, "W")
    );
    out
}

/// What follows from the parameters: rays and lists at once, masks, and the most that each unit could do.
fn derived(out: &mut String, spec: &BoardSpec) {
    let c = &spec.clusters;
    let modules = c.count * c.modules;
    let hz = spec.clock_mhz * 1e6;
    let mut row = |name: &str, text: String| {
        let _ = writeln!(out, "{name:<12}  {text}");
    };
    row(
        "\nderived",
        format!(
            " {} clusters, {modules} modules with an ICU each, {} CTUs",
            c.count,
            modules * c.ctus_per_icu
        ),
    );
    let contexts = modules * c.ctus_per_icu * spec.ctu.contexts;
    let (slots, lists) = (c.count * c.bundle_slots, modules * spec.loader.slots);
    let inside = if spec.partition.is_shells() { "steps in the CTUs" } else { "rays in the CTUs" };
    row("at once", format!("{slots} bundles, {contexts} {inside}, {lists} cell lists"));
    // So many patches that rounding up to whole lines does not show.
    const MANY: u32 = 1 << 20;
    let mask_bytes = spec.mask_bytes(MANY) / u64::from(MANY);
    if mask_bytes > 0 {
        row(
            "masks",
            format!(
                "{mask_bytes} B of patch memory a patch: a line for 4 patches, a bundle slot and a module"
            ),
        );
    }
    let tests = hz * f64::from(modules) / f64::from(spec.icu_timing().initiation_interval);
    let steps = hz * f64::from(modules * c.ctus_per_icu) / f64::from(spec.ctu.initiation_interval);
    row(
        "peak rates",
        format!(
            "{}, {}, {} expanded",
            si(tests, "tests/s"),
            si(steps, "steps/s"),
            si(hz * f64::from(c.count), "rays/s")
        ),
    );
    let d = &spec.dram;
    let line = |first: u32| hz / f64::from(first + rtl_model::memory::LINE_BYTES * 8 / d.width_bits);
    let bytes_of = |lines: f64| si(lines * f64::from(rtl_model::memory::LINE_BYTES), "B/s");
    row(
        "DRAM",
        format!(
            "{} = {} from open rows, {} = {} from closed ones",
            si(line(d.row_hit_cycles), "lines/s"),
            bytes_of(line(d.row_hit_cycles)),
            si(line(d.row_miss_cycles), "lines/s"),
            bytes_of(line(d.row_miss_cycles))
        ),
    );
    let b = &spec.bus;
    let words = f64::from(b.burst_bytes * 8 / b.width_bits);
    let burst = f64::from(b.burst_bytes) * b.clock_mhz * 1e6 / (words + f64::from(b.arbitration_cycles));
    let wire = f64::from(b.width_bits / 8) * b.clock_mhz * 1e6;
    row("host bus", format!("{} in full bursts, {} without arbitration", si(burst, "B/s"), si(wire, "B/s")));
    let overhead = b.dma_setup_cycles + b.interrupt_cycles + spec.dispatch.host_cycles_per_command;
    row("command", format!("{overhead} cycles = {} beside its work", si(overhead as f64 / hz, "s")));
}

fn scene_text(inspected: &Inspected) -> String {
    let Inspected { scene, mesh, .. } = inspected;
    let mut out = format!("scene {}\n\n", scene.path.display());
    match &scene.camera {
        Some(c) => {
            let v = |p| format!("({})", vector(p));
            let _ = writeln!(
                out,
                "camera     eye {} m, target {} m, up {}, {} degrees high",
                v(c.eye),
                v(c.target),
                v(c.up),
                c.fov_y_deg
            );
        }
        None => out.push_str("camera     none: cannot be rendered, only solved and probed\n"),
    }
    let _ = writeln!(out, "lights     {} without area", scene.lights.len());
    let target = match scene.meshing.target {
        MeshTarget::Elements(n) => format!("{n} elements wanted"),
        MeshTarget::MaxElementM(m) => format!("edges up to {}", si(m, "m")),
    };
    let _ = writeln!(
        out,
        "mesh       {} elements, {} vertices, {} patches ({} known to casters), {} T-junction edges; {target}{}{}",
        mesh.elements.len(),
        mesh.vertices.len(),
        mesh.patches.len(),
        mesh.n_cast_patches,
        mesh.n_t_junctions,
        if scene.meshing.edge_grading > 1.0 { ", finer toward borders" } else { "" },
        if scene.meshing.adaptive { "; refined by pass 1" } else { "" }
    );
    imported(&mut out, scene);
    memory_table(&mut out, mesh);
    let _ = match &inspected.board_image {
        Ok(image) => writeln!(
            out,
            "board      patch memory {} on {DEFAULT_BOARD}: {:.1} B a patch, {} of them its record, the rest cells and \
             their lists;\n           grid of {n} x {n} x {n} cells\n",
            bytes(image.size_bytes),
            image.size_bytes as f64 / mesh.n_cast_patches.max(1) as f64,
            bytes(image.record_bytes),
            n = image.cells_per_side
        ),
        Err(e) => writeln!(out, "board      {DEFAULT_BOARD} cannot take the scene: {e}\n"),
    };
    materials_table(&mut out, scene);
    surfaces_table(&mut out, scene, mesh);
    out
}

/// Bytes by element, vertex and patch, and of all.
fn memory_table(out: &mut String, mesh: &Mesh) {
    let memory = HostMemory::of(mesh, &SolveOptions::default());
    let _ = writeln!(
        out,
        "memory     {:<26} {:>11} {:>11} {:>11} {:>12}",
        "host", "an element", "a vertex", "a patch", "all"
    );
    let parts = [
        ("mesh", memory.mesh),
        ("solution", memory.solution),
        ("kernel shots, beside both", memory.solve),
        ("bundles, beside both", memory.stochastic),
    ];
    for (name, part) in parts {
        let each = [part.element_bytes, part.vertex_bytes, part.patch_bytes];
        let [element, vertex, patch] =
            each.map(|b| if b > 0.0 { format!("{b:.0} B") } else { "-".to_owned() });
        let all = bytes(memory.total_bytes(part));
        let _ = writeln!(out, "           {name:<26} {element:>11} {vertex:>11} {patch:>11} {all:>12}");
    }
    let _ = writeln!(
        out,
        "           rows of form factors: up to {} a patch that shoots, {} in all",
        bytes(memory.row_bytes),
        bytes(memory.max_row_bytes)
    );
}

/// What became of the polygons of model files.
fn imported(out: &mut String, scene: &Scene) {
    let (mut counts, mut n_faces, mut memory) = (FaceCounts::default(), 0, 0);
    for surface in &scene.surfaces {
        if let Shape::Faces(set) = &surface.shape {
            counts += set.counts();
            n_faces += set.n_faces();
            memory += set.memory_bytes();
        }
    }
    if n_faces == 0 {
        return;
    }
    let FaceCounts { n_polygons, n_degenerate, n_doubled, n_cut, n_joined, n_welded } = counts;
    let _ = writeln!(
        out,
        "imported   {n_faces} faces of {n_polygons} polygons ({n_degenerate} without area, {n_doubled} doubled, {n_cut} cut, \
         {n_joined} pairs joined), {n_welded} points welded; {}",
        bytes(memory as u64)
    );
}

fn rgb(c: Rgb) -> String {
    let [r, g, b] = c.0;
    if r == g && g == b { format!("{r:.4}") } else { format!("{r:.4} {g:.4} {b:.4}") }
}

fn materials_table(out: &mut String, scene: &Scene) {
    let name = scene.materials.iter().map(|m| m.name.len()).max().unwrap_or(0).max("material".len());
    let _ = writeln!(
        out,
        "{:<name$}  {:<22}  {:<22}  {:<22}  ior",
        "material", "reflectance", "specular", "transmission"
    );
    for m in &scene.materials {
        let _ = writeln!(
            out,
            "{:<name$}  {:<22}  {:<22}  {:<22}  {}",
            m.name,
            rgb(m.reflectance),
            rgb(m.specular),
            rgb(m.transmission),
            if m.transmission.is_black() { "-".to_owned() } else { m.ior.to_string() }
        );
    }
    out.push('\n');
}

fn surfaces_table(out: &mut String, scene: &Scene, mesh: &Mesh) {
    let name = scene.surfaces.iter().map(|s| s.name.len()).max().unwrap_or(0).max("surface".len());
    let material = scene.materials.iter().map(|m| m.name.len()).max().unwrap_or(0).max("material".len());
    let _ = writeln!(
        out,
        "{:<name$}  {:<8}  {:<material$}  {:>5}  {:>7}  {:>10}  emission (W/m^2)",
        "surface", "shape", "material", "sides", "patches", "area"
    );
    for (surface, patches) in scene.surfaces.iter().zip(&mesh.surfaces) {
        let shape = match surface.shape {
            Shape::Quad(_) => "quad",
            Shape::Triangle(_) => "triangle",
            Shape::Disk { .. } => "disk",
            Shape::Sphere { .. } => "sphere",
            Shape::Cylinder { .. } => "cylinder",
            Shape::Faces(_) => "faces",
        };
        let front = &mesh.patches[patches.front.start as usize..patches.front.end as usize];
        let area: f64 = front.iter().map(|p| p.area_m2).sum();
        let _ = writeln!(
            out,
            "{:<name$}  {shape:<8}  {:<material$}  {:>5}  {:>7}  {:>10}  {}",
            surface.name,
            scene.material(surface).name,
            if surface.two_sided { 2 } else { 1 },
            front.len(),
            format!("{area:.4} m^2"),
            if surface.exitance.is_black() { "-".to_owned() } else { rgb(surface.exitance) }
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn board_text_names_the_division_unit_its_timing_and_its_registers() {
        let text = |toml: &str| board_text(&BoardSpec::from_toml(toml).unwrap());
        let plain = text("");
        assert!(plain.contains("division.unit") && plain.contains("in-pipeline"));
        assert!(!plain.contains("division: latency") && !plain.contains("div_"));
        let serial = text("[division]\nunit = \"non-restoring\"\nform = \"serial\"");
        assert!(serial.contains("division: latency 30 cycles, initiation interval 30 cycles"), "{serial}");
        assert!(serial.contains("depth 52 cycles, initiation interval 30 cycles"), "{serial}");
        assert!(serial.contains("\ndiv_shifted_remainder "), "{serial}");
        let newton = text("[division]\nunit = \"newton\"");
        assert!(newton.contains("division: latency 11 cycles, initiation interval 1 cycles"), "{newton}");
        assert!(newton.contains("\ndiv_reciprocal "), "{newton}");
    }

    #[test]
    fn cost_text_lists_every_block_and_sums_them_in_every_technology() {
        let spec = BoardSpec::default();
        for technology in Technology::all() {
            let cost = Cost::of(&spec, technology);
            let text = cost_text(&cost, &spec);
            for b in &cost.blocks {
                let line = text.lines().find(|line| line.starts_with(&format!("{} ", b.block))).unwrap();
                let words: Vec<&str> = line.split_whitespace().collect();
                let (count, flip_flops) = (b.instances.to_string(), b.flip_flops.to_string());
                assert_eq!((words[1], words[3]), (count.as_str(), flip_flops.as_str()), "{line}");
            }
            let sum = text.lines().find(|line| line.starts_with("board ")).unwrap();
            assert!(sum.contains(&cost.flip_flops.to_string()) && sum.contains(cost.critical_block), "{sum}");
            assert_eq!(text.contains("LUTs"), technology.is_fpga);
            assert!(text.contains(&format!("fastest clock {:.1} MHz", cost.max_clock_mhz)), "{text}");
        }
        let fast = BoardSpec { clock_mhz: 1000.0, ..spec };
        assert!(cost_text(&Cost::of(&fast, &Technology::all()[0]), &fast).contains("1000 MHz is beyond it"));
    }

    #[test]
    fn board_text_derives_rates_and_masks_by_hand() {
        let text = board_text(&BoardSpec::preset("delft-1992").unwrap());
        for part in [
            "4 clusters, 4 modules with an ICU each, 16 CTUs",
            "16 bundles, 256 steps in the CTUs, 32 cell lists",
            // 16 B x 4 clusters x 1 module x 4 slots.
            "256 B of patch memory a patch",
            "100 Mtests/s, 400 Msteps/s, 100 Mrays/s expanded",
            // 25 MHz / (2 + 16), / (6 + 16) cycles a line of 64 B.
            "1.39 Mlines/s = 88.9 MB/s from open rows, 1.14 Mlines/s = 72.7 MB/s",
            // 64 B in 16 + 4 cycles of 40 ns.
            "80.0 MB/s in full bursts, 100 MB/s without",
            "550 cycles = 22.0 us",
        ] {
            assert!(text.contains(part), "'{part}' is missing in\n{text}");
        }
        let minimal = board_text(&BoardSpec::preset("minimal").unwrap());
        assert!(minimal.contains("1 bundles, 1 rays in the CTUs, 1 cell lists"), "{minimal}");
        assert!(!minimal.contains("\nmasks"), "{minimal}");
    }

    #[test]
    fn board_or_scene_is_told_by_preset_name_and_by_keys() {
        let dir = tempfile::tempdir().unwrap();
        let file = |name: &str, text: &str| {
            let path = dir.path().join(name);
            std::fs::write(&path, text).unwrap();
            path
        };
        assert!(is_board(Path::new("delft-1992")));
        assert!(!is_board(Path::new("no-such-thing")));
        assert!(is_board(&file("board.toml", "clock_mhz = 33.0\n")));
        assert!(!is_board(&file("scene.toml", "version = 1\n[[surface]]\nname = 'a'\n")));
        assert!(!is_board(&file("broken.toml", "version = \n")));
        assert!(!is_board(&file("empty.toml", "")));
        assert!(!is_board(dir.path()));
    }
}
