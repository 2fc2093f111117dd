//! `[analysis]`, `[method]`, `[conditioning]`.

use crate::basis::Domain;
use crate::deck::model::{
    AffineTransfer, Analysis, AnalysisType, Basis, Damping, GimpEdge, Mass, Method, StressUpdate,
};
use crate::deck::problems::Got;
use crate::deck::reader::Table;
use crate::deck::schema::between;
use crate::deck::tree::Value;

use super::ghost::Wanted;

/// `staged`: the stages have steps and durations.
pub fn analysis(table: &Table<'_>, staged: bool) -> Got<Analysis> {
    let kind: Got<AnalysisType> = table.choice("type");
    let symmetry = table.choice("symmetry");
    let steps = table.count_if("steps");
    let duration = table.number_if("duration");
    let cfl = table.number_if("cfl");
    let tolerance = table.number("tolerance");
    let max_iterations = table.count("max_iterations");
    let on_failure = table.choice("on_failure");
    let smallest_step = table.number("smallest_step");
    let inverted_iterates = table.choice("inverted_iterates");
    let tangent = table.choice("tangent");
    let newmark = (table.number("newmark_beta"), table.number("newmark_gamma"));
    let hht_alpha = table.number("hht_alpha");
    let strength_tolerance = table.number("strength_tolerance");
    let damping = table.table_if("damping", |table| damping(&table));
    let kind = kind?;
    let timing = timing(table, kind, staged);
    let (newmark_beta, newmark_gamma, hht_alpha) = (newmark.0?, newmark.1?, hht_alpha?);
    let (newmark_beta, newmark_gamma) = if hht_alpha == 0.0 {
        stable_newmark(table, newmark_beta, newmark_gamma)?;
        (newmark_beta, newmark_gamma)
    } else {
        let set = ((1.0 - hht_alpha).powi(2) / 4.0, (1.0 - 2.0 * hht_alpha) / 2.0);
        for (key, given, wanted) in
            [("newmark_beta", newmark_beta, set.0), ("newmark_gamma", newmark_gamma, set.1)]
        {
            if table.given(key) && given != wanted {
                return Err(table.problem(
                    key,
                    format!("hht_alpha = {hht_alpha} sets it to {wanted}; leave one of them out"),
                ));
            }
        }
        set
    };
    timing?;
    Ok(Analysis {
        kind,
        symmetry: symmetry?,
        steps: steps?,
        duration: duration?,
        cfl: cfl?,
        tolerance: tolerance?,
        max_iterations: max_iterations?,
        on_failure: on_failure?,
        smallest_step: smallest_step?,
        inverted_iterates: inverted_iterates?,
        tangent: tangent?,
        newmark_beta,
        newmark_gamma,
        hht_alpha,
        strength_tolerance: strength_tolerance?,
        damping: damping?,
    })
}

fn damping(table: &Table<'_>) -> Got<Damping> {
    let (local, mass) = (table.number_if("local")?, table.number_if("mass")?);
    if local.is_none() && mass.is_none() {
        return Err(table.problem("", "damps nothing: expected \"local\", \"mass\" or both"));
    }
    Ok(Damping { local: local.unwrap_or(0.0), mass: mass.unwrap_or(0.0) })
}

/// Which of steps, duration and cfl the kind of analysis takes.
fn timing(table: &Table<'_>, kind: AnalysisType, staged: bool) -> Got<()> {
    let dynamic = kind.has_time();
    let name = kind.name();
    let mut result = Ok(());
    if kind == AnalysisType::ElementTest {
        let why = "type = \"element-test\" counts its steps in element_test.steps";
        return table.refuse(&["steps", "duration", "cfl"], why);
    }
    if staged {
        result = table.refuse(&["steps", "duration"], "each [[stage]] has its own");
    }
    if dynamic && !table.given("duration") && !staged {
        result = Err(table.missing("duration", &format!("type = \"{name}\" needs it")));
    }
    if !dynamic {
        let why = format!("type = \"{name}\" has no time; steps alone count");
        result = result.and(table.refuse(&["duration", "cfl"], &why));
    }
    if kind == AnalysisType::ImplicitDynamic {
        result =
            result.and(table.refuse(&["cfl"], "only type = \"explicit\" takes it; give steps"));
    }
    if kind == AnalysisType::Explicit && table.given("cfl") {
        let why = "steps and cfl exclude each other: give the number of steps, or the fraction of the stability limit";
        return result.and(table.refuse(&["steps"], why));
    }
    if !table.given("steps") && !staged {
        let or = if kind == AnalysisType::Explicit { "or give cfl" } else { "" };
        result = result.and(Err(table.missing("steps", or)));
    }
    result
}

fn stable_newmark(table: &Table<'_>, beta: f64, gamma: f64) -> Got<()> {
    let least = (gamma + 0.5).powi(2) / 4.0;
    if beta < least * (1.0 - 1e-12) {
        return Err(table.problem(
            "newmark_beta",
            format!("expected at least (gamma + 1/2)^2 / 4 = {least}, for stability, found {beta}"),
        ));
    }
    Ok(())
}

/// `ghost` and `kind`: what was read before, if that succeeded.
pub fn method(
    table: &Table<'_>,
    ghost: Option<&Wanted>,
    kind: Option<AnalysisType>,
) -> Got<Method> {
    let basis: Got<Basis> = table.choice("basis");
    let domain_update = table.choice("domain_update");
    let gimp_edge = table.choice("gimp_edge");
    let point_volume = table.choice("point_volume");
    let locking = table.choice("locking");
    let frame = table.choice("frame");
    let mass = table.choice("mass");
    let stress_update = table.choice("stress_update");
    let position_update = table.choice("position_update");
    let velocity = velocity_update(table);
    let order = table.count_if("xpic_order");
    let drop_below = table.number_if("drop_below");
    let VelocityUpdate { flip, xpic, affine } = velocity?;
    let order = order?;
    let explicit_only = if xpic { Some("xpic") } else { affine.map(AffineTransfer::name) };
    if let Some(name) = explicit_only
        && kind.is_some_and(|kind| kind != AnalysisType::Explicit)
    {
        return Err(table.problem(
            "velocity_update",
            format!(
                "\"{name}\" is for analysis.type = \"explicit\"; implicit dynamics reads \"flip\", \
                 \"pic\" or a number"
            ),
        ));
    }
    let stiffened = ghost.is_some_and(|ghost| ghost.stiffens(kind));
    let mass = mass?;
    if xpic && mass == Mass::Consistent && table.given("mass") {
        return Err(table.problem(
            "mass",
            "velocity_update = \"xpic\" stands in for the inverse of the consistent mass; use \
             mass = \"lumped\"",
        ));
    }
    if let Some(affine) = affine
        && mass == Mass::Consistent
        && table.given("mass")
    {
        return Err(table.problem(
            "mass",
            format!(
                "velocity_update = \"{}\" is derived for mass = \"lumped\"; with mass = \
                 \"consistent\", \"flip\" keeps the angular momentum as it is",
                affine.name()
            ),
        ));
    }
    let mass = if xpic || affine.is_some() { Mass::Lumped } else { mass };
    let (basis, point_volume, locking) = (basis?, point_volume?, locking?);
    let (gimp_edge, stress_update) = (gimp_edge?, stress_update?);
    if let Some(affine) = affine {
        allows_affine(table, affine, basis, gimp_edge, stress_update)?;
    }
    // Explicit steps keep every node that has mass: dropping one would lose its momentum.
    let keeps_all = stiffened || kind == Some(AnalysisType::Explicit);
    Ok(Method {
        basis,
        domain_update: domain_update?,
        gimp_edge,
        point_volume,
        locking,
        frame: frame?,
        mass,
        stress_update,
        position_update: position_update?,
        flip,
        xpic: xpic.then(|| order.unwrap_or(2)),
        affine,
        drop_below: drop_below?.unwrap_or(if keeps_all { 0.0 } else { 1e-8 }),
    })
}

/// What `velocity_update` stands for.
struct VelocityUpdate {
    /// FLIP share.
    flip: f64,
    xpic: bool,
    affine: Option<AffineTransfer>,
}

fn velocity_update(table: &Table<'_>) -> Got<VelocityUpdate> {
    let share = |flip| VelocityUpdate { flip, xpic: false, affine: None };
    let Some(node) = table.node("velocity_update") else { return Ok(share(1.0)) };
    let Value::String(word) = &node.value else {
        return Ok(share(table.number_from("velocity_update", node, between(0.0, 1.0))?));
    };
    let affine = |affine| VelocityUpdate { affine: Some(affine), ..share(0.0) };
    match word.as_str() {
        "flip" => Ok(share(1.0)),
        "pic" => Ok(share(0.0)),
        "xpic" => Ok(VelocityUpdate { xpic: true, ..share(0.0) }),
        "apic" => Ok(affine(AffineTransfer::Apic)),
        "tpic" => Ok(affine(AffineTransfer::Tpic)),
        _ => Err(table.unknown_word(
            "velocity_update",
            word,
            &["flip", "pic", "xpic", "apic", "tpic"],
            &node.origin,
        )),
    }
}

/// The affine transfers need functions that give linear fields back, and forces without a moment
/// about the places of the nodes; see [`crate::transfer::affine`].
fn allows_affine(
    table: &Table<'_>,
    affine: AffineTransfer,
    basis: Basis,
    edge: GimpEdge,
    update: StressUpdate,
) -> Got<()> {
    let name = affine.name();
    if update == StressUpdate::Usf {
        return Err(table.problem(
            "stress_update",
            format!(
                "velocity_update = \"{name}\" keeps no angular momentum where the stress is updated \
                 first; use \"musl\" or \"usl\""
            ),
        ));
    }
    let problem = |key: &str, text: &str| {
        Err(table.problem(key, format!("velocity_update = \"{name}\" {text}")))
    };
    match basis.domain() {
        Domain::Parallelepiped | Domain::Corners => {
            problem("basis", "is not derived for CPDI domains; use basis = \"gimp\"")
        }
        Domain::None => problem(
            "basis",
            "divides by the spread of a point's weights, which with basis = \"mpm\" is zero on the \
             faces of cells; use basis = \"gimp\"",
        ),
        Domain::Box if edge == GimpEdge::Published => {
            problem("gimp_edge", "needs functions that sum to one; use \"continued\"")
        }
        Domain::Box => Ok(()),
    }
}

/// The rigid motion of a conditioning study, for such an analysis only.
pub fn conditioning(
    root: &Table<'_>,
    analysis: Option<&Analysis>,
    dimension: usize,
) -> Got<Option<Vec<f64>>> {
    let motion = root.table_if("conditioning", |table| table.vector("displacement", dimension))?;
    let Some(analysis) = analysis else { return Ok(motion) };
    match (analysis.kind == AnalysisType::Conditioning, &motion) {
        (true, None) => {
            Err(root.missing("conditioning", "analysis.type = \"conditioning\" needs it"))
        }
        (false, Some(_)) => Err(root.problem(
            "conditioning",
            format!(
                "only for analysis.type = \"conditioning\", found \"{}\"",
                analysis.kind.name()
            ),
        )),
        _ => Ok(motion),
    }
}
