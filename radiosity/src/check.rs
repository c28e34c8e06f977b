//! The laws that form factors and answers must keep, and by how much they do not.
//!
//! What patch i sends out arrives somewhere, Σ_j F_ij + elsewhere = 1 (closure); what i sends to j, j would send to i,
//! A_i F_ij = A_j F_ji (reciprocity); and all that is emitted is absorbed or gone (energy).

use crate::form_factors::{ExchangeAreas, FormFactors, Passes, Row};
use crate::light::Rgb;
use crate::patches::Patches;
use crate::solve::Solution;
use crate::watch::{Interrupted, Watch};

/// How well form factors keep their laws.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Laws {
    /// The greatest |1 - Σ_j F_ij - elsewhere|, and of which patch.
    pub closure: (f64, u32),
    /// By how much reciprocity is off: Σ |A_i F_ij - A_j F_ji| / Σ (A_i F_ij + A_j F_ji), 0 to 1, of all that is not seen on lit
    /// backs.
    pub reciprocity: f64,
    /// Of the energy exchanged between patches, the share that is seen on lit backs: there is no reciprocity for it.
    pub behind: f64,
    /// The share of each patch's energy that leaves the scene.
    pub surroundings: Vec<f64>,
    /// The share that meets black backs.
    pub backs: Vec<f64>,
}

impl Laws {
    /// Of these form factors. Takes memory besides: [`ExchangeAreas::bytes`].
    pub fn of(patches: &Patches, factors: &FormFactors) -> Self {
        let elsewhere = || factors.rows().iter().map(Row::elsewhere);
        let gap = |row: &Row| (1.0 - row.sum() - row.elsewhere().surroundings - row.elsewhere().backs).abs();
        let worst = |worst: (f64, u32), (gap, patch)| if gap > worst.0 { (gap, patch) } else { worst };
        let areas = ExchangeAreas::average(&patches.area, factors, |i, j| patches.is_behind(i, j));
        Self {
            closure: factors.rows().iter().map(gap).zip(0..).fold((0.0, 0), worst),
            reciprocity: areas.imbalance(),
            behind: areas.behind(),
            surroundings: elsewhere().map(|elsewhere| elsewhere.surroundings).collect(),
            backs: elsewhere().map(|elsewhere| elsewhere.backs).collect(),
        }
    }

    /// Patches that see nothing at all.
    pub fn blind(&self) -> impl Iterator<Item = u32> + '_ {
        let blind = |share: f64| share > 1.0 - 1e-6;
        self.surroundings.iter().zip(0..).filter(move |&(&share, _)| blind(share)).map(|(_, patch)| patch)
    }
}

/// Where the power goes, a channel: power per area times area.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// Σ A E.
    pub emitted: Rgb,
    /// Σ A_i B s: what comes in from the surroundings, s being the share of them that patch i sees.
    pub received: Rgb,
    /// Σ A (1 - ρ) H.
    pub absorbed: Rgb,
    /// Σ A_i B_i s: what leaves the scene.
    pub lost: Rgb,
    /// What meets black backs.
    pub on_backs: Rgb,
}

impl Energy {
    /// Of an answer found with these rows, amid surroundings of this radiosity.
    ///
    /// # Errors
    /// [`Interrupted`] where `watch`, told of rows that are found for it, says stop.
    pub fn of(
        patches: &Patches,
        rows: &impl Passes,
        solution: &Solution,
        surroundings: Rgb,
        watch: &mut Watch<'_>,
    ) -> Result<Self, Interrupted> {
        let mut energy = Self { emitted: patches.total_power(), ..Self::default() };
        rows.pass(watch, |i, row| {
            let (area, elsewhere) = (patches.area[i], row.elsewhere());
            let absorbed = (Rgb::WHITE - patches.reflectance[i]) * solution.irradiance[i];
            energy.absorbed += absorbed * area;
            energy.received += surroundings * (area * elsewhere.surroundings);
            energy.lost += solution.radiosity[i] * (area * elsewhere.surroundings);
            energy.on_backs += solution.radiosity[i] * (area * elsewhere.backs);
        })?;
        Ok(energy)
    }

    /// What is emitted or received and neither absorbed nor gone, as a share of the former; negative where more is absorbed. It
    /// is what the method's lack of reciprocity, and the solver's residual, make of nothing or to nothing.
    pub fn imbalance(&self) -> Rgb {
        let (coming, going) = (self.emitted + self.received, self.absorbed + self.lost + self.on_backs);
        let share = |coming: f64, going: f64| if coming > 0.0 { (coming - going) / coming } else { 0.0 };
        Rgb::new(share(coming.r, going.r), share(coming.g, going.g), share(coming.b, going.b))
    }
}
