//! What the verification suite has measured of each method: `measured.csv`, which it writes.

/// The file, a line a method.
pub const TABLE: &str = include_str!("measured.csv");

/// The first line of the file.
pub const HEAD: &str = "name,order,symplectic_defect,reversibility_defect,energy_error,\
                        energy_drift,evaluations,products";

/// Figures of a method. How they are measured stands in `docs/methods.md`.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// The slope of the error over the step; `None` where there is rounding alone.
    pub order: Option<f64>,
    /// Largest entry of `W^T J W - J`, W the tangent map of a step.
    pub symplectic_defect: f64,
    /// How far a step forth and one back end from where they began, of the largest component.
    pub reversibility_defect: f64,
    /// Largest relative error of the energy over 1e5 steps.
    pub energy_error: f64,
    /// By how much the mean of that error has changed from the first tenth to the last.
    pub energy_drift: f64,
    /// Evaluations of the right side a step.
    pub evaluations: f64,
    /// Products of a matrix and a block of states a step.
    pub products: f64,
}

impl Measured {
    /// What there is of a method.
    pub fn find(name: &str) -> Option<Measured> {
        let line = TABLE.lines().skip(1).find(|line| line.split(',').next() == Some(name))?;
        let cells: Vec<&str> = line.split(',').skip(1).collect();
        let [order, rest @ ..] = &cells[..] else { return None };
        let figures: Vec<f64> = rest.iter().map_while(|cell| cell.parse().ok()).collect();
        let [
            symplectic_defect,
            reversibility_defect,
            energy_error,
            energy_drift,
            evaluations,
            products,
        ] = figures[..]
        else {
            return None;
        };
        Some(Measured {
            order: order.parse().ok(),
            symplectic_defect,
            reversibility_defect,
            energy_error,
            energy_drift,
            evaluations,
            products,
        })
    }

    /// The line of a method.
    pub fn line(&self, name: &str) -> String {
        let order = self.order.map(|order| format!("{order:.2}")).unwrap_or_default();
        format!(
            "{name},{order},{:.1e},{:.1e},{:.1e},{:.1e},{:.3},{:.3}",
            self.symplectic_defect,
            self.reversibility_defect,
            self.energy_error,
            self.energy_drift,
            self.evaluations,
            self.products
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_read_as_it_was_written() {
        for line in TABLE.lines().skip(1) {
            let name = line.split(',').next().unwrap();
            assert_eq!(Measured::find(name).unwrap().line(name), line);
        }
        assert_eq!(Measured::find("no method"), None);
    }
}
