//! `radiosity check`: whether a scene, its form factors and its answer can be trusted, in plain words.

use std::io::{self, Write};

use radiosity::bake::{self, BakeError};
use radiosity::check::{Energy, Laws};
use radiosity::patches::{self, Cutting, Patches};
use radiosity::scene::{self, BackFaces, Found, Overlap, Scene, check_meshes, coincident, overlaps};
use radiosity::solve::SolveError;
use serde::Serialize;

use crate::args::Check;
use crate::backs::named;
use crate::failure::Failure;
use crate::job::Job;
use crate::numbers::{grouped, measure, percent};
use crate::progress::Bar;
use crate::{interrupt, stages};

/// Light that leaves a scene by less than this, as a share of all that is exchanged, leaks; more of it, and the scene is open.
const OPEN: f64 = 0.01;

/// The least share of a patch's energy that counts as gone: one cell of a hemicube's corner in a hundred.
const LEAK: f64 = 1e-5;

/// How far a row may be off 1, reciprocity off, energy lost, and light met by black backs, without a word; and from where on it
/// is wrong. A hemicube of 100 on patches as an author cuts them is off reciprocity by some hundredths.
const CLOSURE: [f64; 2] = [1e-4, 1e-2];
const RECIPROCITY: [f64; 2] = [0.1, 0.5];
const ENERGY: [f64; 2] = [0.01, 0.1];
const ON_BACKS: [f64; 2] = [0.001, 0.05];

/// Objects that are named.
const NAMED: usize = 3;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
enum Verdict {
    Ok,
    Note,
    Wrong,
}

/// One thing that was looked at.
#[derive(Debug, Serialize)]
struct Finding {
    verdict: Verdict,
    /// A word for it.
    what: &'static str,
    /// What was found.
    told: String,
    /// What to do about it, where something is.
    #[serde(skip_serializing_if = "Option::is_none")]
    advice: Option<String>,
    /// What was measured, where one number tells it.
    #[serde(skip_serializing_if = "Option::is_none")]
    value: Option<f64>,
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct Findings<'a> {
    scene: String,
    patches: usize,
    wrong: usize,
    findings: &'a [Finding],
}

impl Finding {
    fn new(verdict: Verdict, what: &'static str, told: impl Into<String>) -> Self {
        Self { verdict, what, told: told.into(), advice: None, value: None }
    }

    fn advice(self, advice: impl Into<String>) -> Self {
        match self.verdict {
            Verdict::Ok => self,
            _ => Self { advice: Some(advice.into()), ..self },
        }
    }

    fn value(self, value: f64) -> Self {
        Self { value: Some(value), ..self }
    }
}

/// Whether all is right.
pub(crate) fn run(typed: &Check) -> Result<bool, Failure> {
    let job = Job::new(&typed.common)?;
    let scene = scene::read(&job.scene)?;
    interrupt::check()?;
    let mut findings = of_scene(&scene, job.request.back_faces.unwrap_or(scene.back_faces));
    let patches = match scene.surfaces.is_empty() {
        true => 0,
        false => of_light(&job, &scene, &mut findings)?,
    };

    let wrong = findings.iter().filter(|finding| finding.verdict == Verdict::Wrong).count();
    let mut out = io::stdout().lock();
    if typed.json {
        let scene = job.scene.display().to_string();
        let all = Findings { scene, patches, wrong, findings: &findings };
        serde_json::to_writer_pretty(&mut out, &all).map_err(io::Error::from)?;
        writeln!(out)?;
    } else {
        for Finding { verdict, what, told, advice, .. } in &findings {
            let verdict = match verdict {
                Verdict::Ok => "ok",
                Verdict::Note => "note",
                Verdict::Wrong => "WRONG",
            };
            writeln!(out, "{verdict:<6} {what:<13} {told}")?;
            if let Some(advice) = advice {
                writeln!(out, "{:<6} {:<13} -> {advice}", "", "")?;
            }
        }
    }
    out.flush()?;
    Ok(wrong == 0)
}

/// What the scene itself tells.
fn of_scene(scene: &Scene, back_faces: BackFaces) -> Vec<Finding> {
    let mut findings = Vec::new();
    let mut note = |finding: Finding| findings.push(finding);
    if let Some(first) = scene.warnings.first() {
        let more = scene.warnings.len() - 1;
        let others = if more > 0 { format!(" (and {} more)", grouped(more)) } else { String::new() };
        note(Finding::new(Verdict::Note, "reading", format!("{first}{others}")));
    }
    if scene.surfaces.is_empty() {
        note(Finding::new(Verdict::Wrong, "surfaces", "there is none"));
        return findings;
    }

    let lamps = scene.surfaces.iter().filter(|surface| !surface.material.emission.is_black()).count();
    note(match lamps {
        0 => Finding::new(Verdict::Wrong, "lamps", "nothing emits light: all will be black")
            .advice("give a lamp an emission (CE in a .scn, Ke in a .mtl, emissiveFactor in glTF)"),
        n => Finding::new(
            Verdict::Ok,
            "lamps",
            format!("{} of {} surfaces", grouped(n), grouped(scene.surfaces.len())),
        ),
    });

    let reflecting_all =
        || (0..).zip(&scene.surfaces).filter(|(_, surface)| surface.material.diffuse.max_channel() >= 1.0);
    note(match reflecting_all().count() {
        0 => Finding::new(Verdict::Ok, "reflectance", "below 1 everywhere"),
        _ => Finding::new(
            Verdict::Wrong,
            "reflectance",
            format!("1 or more of {}", names(scene, reflecting_all().map(|(index, _)| index))),
        )
        .advice("no surface gives back more than it receives: make it less than 1 (paint: 0.8, snow: 0.9)"),
    });

    let doubles = coincident(scene, back_faces);
    note(match doubles.first() {
        None => Finding::new(Verdict::Ok, "duplicates", "no surface lies exactly on another"),
        Some([first, _]) => Finding::new(
            Verdict::Wrong,
            "duplicates",
            format!(
                "{} on {}",
                names(scene, doubles.iter().map(|&[_, second]| second)),
                named(scene, *first)
            ),
        )
        .advice("only one of two that lie on one another is seen: take the other out"),
    });

    let overlapping = overlaps(scene).into_iter().filter(|overlap| !doubles.contains(&overlap.surfaces));
    if let Some(Overlap { surfaces: [first, second], area, at }) = overlapping.clone().next() {
        let [x, y, z] = at.to_array().map(measure);
        let told = format!(
            "{} on {} over an area of {}, such as at {x} {y} {z}; {} in all",
            named(scene, second),
            named(scene, first),
            measure(area),
            grouped(overlapping.count())
        );
        note(Finding::new(Verdict::Wrong, "overlaps", told).advice(
            "they lie in one plane and only one is seen there: cut one out, or lift the other a little",
        ));
    }

    let faults = check_meshes(scene);
    if faults.triangles > 0 {
        let at = |found: Found| match found.example {
            Some((place, surface)) => {
                let [x, y, z] = place.to_array().map(measure);
                format!(", the first at {x} {y} {z} ({})", named(scene, surface))
            }
            None => String::new(),
        };
        let kinds = [
            (
                faults.turned,
                Verdict::Wrong,
                "edges between fronts and backs",
                Some("make the normals of each mesh agree (in Blender: Mesh, Normals, Recalculate Outside)"),
            ),
            (faults.crowded, Verdict::Note, "edges of more than two triangles", None),
            (
                faults.open,
                Verdict::Note,
                "open edges",
                Some("the rim of a sheet is one; of a solid it is a hole that light leaks through"),
            ),
        ];
        if kinds.iter().all(|(found, ..)| found.count == 0) {
            note(Finding::new(Verdict::Ok, "meshes", "whole, and their fronts agree"));
        }
        for (found, verdict, kind, advice) in kinds.into_iter().filter(|(found, ..)| found.count > 0) {
            let told = format!("{} {kind}{}", grouped(found.count), at(found));
            let finding = Finding::new(verdict, "meshes", told);
            note(match advice {
                Some(advice) => finding.advice(advice),
                None => finding,
            });
        }
    }
    findings
}

/// What its form factors and its answer tell; the number of patches.
fn of_light(job: &Job, scene: &Scene, findings: &mut Vec<Finding>) -> Result<usize, Failure> {
    let (patches, facets) = stages::patches(job, scene)?;
    let cutting = job.request.cutting().for_scene(scene).map_err(BakeError::from)?;
    if !cutting.split {
        let split = patches::count(scene, Cutting { split: true, ..cutting }).map_err(BakeError::from)?;
        let more = split.saturating_sub(patches.len() as u64);
        findings.push(match more {
            0 => Finding::new(Verdict::Ok, "meetings", "no patch lies on both sides of what stands on it"),
            _ => Finding::new(
                Verdict::Note,
                "meetings",
                format!(
                    "patches lie on both sides of what stands on them: split, they would be {} more",
                    grouped(more)
                ),
            )
            .advice("light and shadow leak there: use --split on"),
        });
    }
    let (mut factors, _) = stages::form_factors(job, scene, &patches, &facets)?;
    let laws = Laws::of(&patches, &factors);
    of_form_factors(scene, &patches, &laws, findings);
    if job.request.repair {
        let (areas, _) = stages::repaired(job, &patches, &factors)?;
        factors = areas.form_factors();
    }

    let mut bar = Bar::new(job.quiet);
    let solved = bake::solve(&patches, &factors, &job.request, &mut |at| bar.watch(at));
    bar.clear();
    match solved {
        Ok(solution) => {
            let energy = Energy::of(
                &patches,
                &factors,
                &solution,
                job.request.surroundings,
                &mut radiosity::watch::ignore,
            )
            .map_err(BakeError::from)?;
            findings.push(of_energy(&energy));
        }
        Err(BakeError::Solve(error @ SolveError::Diverges { .. })) => {
            findings.push(Finding::new(Verdict::Wrong, "solution", error.to_string()));
        }
        Err(error) => return Err(error.into()),
    }
    Ok(patches.len())
}

/// How well the laws are kept.
fn of_form_factors(scene: &Scene, patches: &Patches, laws: &Laws, findings: &mut Vec<Finding>) {
    let (gap, patch) = laws.closure;
    let told = format!("every row sums to 1 within {gap:.1e}, with what leaves the scene");
    findings.push(match graded(gap, CLOSURE) {
        Verdict::Ok => Finding::new(Verdict::Ok, "closure", told).value(gap),
        verdict => Finding::new(
            verdict,
            "closure",
            format!("row {patch} ({}) is {gap:.1e} off 1", named(scene, patches.surface[patch as usize])),
        )
        .advice("use a finer --accuracy, or --repair, which closes the rows; --split on where patches lie half under something")
        .value(gap),
    });

    let mean = |shares: &[f64]| {
        let sum: f64 = shares.iter().zip(&patches.area).map(|(share, area)| share * area).sum();
        sum / patches.total_area()
    };
    let gone = mean(&laws.surroundings);
    let seeing = |shares: &[f64], least: f64| {
        let mut surfaces: Vec<(u32, f64)> = Vec::new();
        for (patch, &share) in shares.iter().enumerate().filter(|&(_, &share)| share > least) {
            let surface = patches.surface[patch];
            match surfaces.last_mut().filter(|(last, _)| *last == surface) {
                Some((_, most)) => *most = most.max(share),
                None => surfaces.push((surface, share)),
            }
        }
        surfaces.sort_by(|a, b| b.1.total_cmp(&a.1));
        names(scene, surfaces.into_iter().map(|(surface, _)| surface))
    };
    let any = laws.surroundings.iter().any(|&share| share > LEAK);
    findings.push(
        match (any, gone >= OPEN) {
            (false, _) => Finding::new(Verdict::Ok, "closed", "no patch sees out of the scene"),
            (true, true) => Finding::new(
                Verdict::Note,
                "open",
                format!("{} of all light leaves the scene", percent(gone)),
            )
            .advice("what lies about it is black, unless --surroundings tells"),
            (true, false) => Finding::new(
                Verdict::Wrong,
                "leaks",
                format!(
                    "{} of all light leaves a scene that is closed else; most of it as seen from {}",
                    percent(gone),
                    seeing(&laws.surroundings, LEAK)
                ),
            )
            .advice("look for gaps: surfaces that should meet must have corners or edges in common"),
        }
        .value(gone),
    );

    let blind: Vec<u32> = laws.blind().collect();
    if !blind.is_empty() {
        let surfaces = || {
            let mut surfaces: Vec<u32> = blind.iter().map(|&patch| patches.surface[patch as usize]).collect();
            surfaces.dedup();
            surfaces
        };
        let lamps = blind.iter().any(|&patch| !patches.emission[patch as usize].is_black());
        let verdict = if lamps { Verdict::Wrong } else { Verdict::Note };
        let told = format!("{} patches of {}", grouped(blind.len()), names(scene, surfaces().into_iter()));
        findings.push(
            Finding::new(verdict, "seeing nothing", told).advice(
                "an outer side is right so; else turn it round, for its front looks out of the scene",
            ),
        );
    }

    let backs = mean(&laws.backs);
    findings.push(match graded(backs, ON_BACKS) {
        Verdict::Ok => Finding::new(Verdict::Ok, "black backs", "hardly any light meets one").value(backs),
        verdict => Finding::new(
            verdict,
            "black backs",
            format!(
                "{} of all light meets them and is gone; most of it as seen from {}",
                percent(backs),
                seeing(&laws.backs, ON_BACKS[0])
            ),
        )
        .advice("turn round what shows its back there, or use --back-faces lit")
        .value(backs),
    });

    if laws.behind > ON_BACKS[0] {
        findings.push(
            Finding::new(
                Verdict::Note,
                "lit backs",
                format!(
                    "{} of all light is seen on backs, which send what they never received",
                    percent(laws.behind)
                ),
            )
            .advice("N3D has it so; for physics use --back-faces black")
            .value(laws.behind),
        );
    }

    let told = format!("A_i F_ij and A_j F_ji differ by {} on the mean", percent(laws.reciprocity));
    findings.push(
        Finding::new(graded(laws.reciprocity, RECIPROCITY), "reciprocity", told)
            .advice("cut the scene more finely, raise --precision, or use --repair")
            .value(laws.reciprocity),
    );
}

fn of_energy(energy: &Energy) -> Finding {
    let off = energy.imbalance().to_array();
    let worst =
        off.into_iter().fold(0.0, |worst: f64, off| if off.abs() > worst.abs() { off } else { worst });
    let told = match worst {
        off if off.abs() <= ENERGY[0] => {
            format!("what is emitted is absorbed or gone, within {}", percent(off.abs()))
        }
        off if off > 0.0 => format!("{} of what is emitted arrives nowhere", percent(off)),
        off => format!("{} more arrives than is emitted", percent(-off)),
    };
    Finding::new(graded(worst.abs(), ENERGY), "energy", told)
        .advice("cut the scene more finely, or use --repair or --solver cg, which keep the energy")
        .value(worst)
}

fn graded(value: f64, [noted, wrong]: [f64; 2]) -> Verdict {
    match value {
        v if v <= noted => Verdict::Ok,
        v if v <= wrong => Verdict::Note,
        _ => Verdict::Wrong,
    }
}

/// The first of these surfaces by name, and how many more there are.
fn names(scene: &Scene, surfaces: impl Iterator<Item = u32> + Clone) -> String {
    let count = surfaces.clone().count();
    let told: Vec<_> = surfaces.take(NAMED).map(|surface| named(scene, surface)).collect();
    match count.saturating_sub(NAMED) {
        0 => told.join("; "),
        more => format!("{}; and {} more", told.join("; "), grouped(more)),
    }
}
