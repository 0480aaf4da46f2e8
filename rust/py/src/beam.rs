//! The rotating beam for Python code.

use std::sync::Arc;

use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use spim::Result;
use spim::model::beam::{
    Applied, Beam, Coupling, Elements, Hub, Loads, POINTS, Parameters, Prescribed, SpinUp, Table,
};
use spim::system::Flow;

use crate::convert::{self, check_finite, real, slice, slice_mut};
use crate::error::{from_python, to_python};
use crate::states;

/// A beam on a rotating hub, as the core holds it.
#[pyclass(frozen, module = "spim._core")]
pub struct RotatingBeam {
    /// The model.
    pub beam: Arc<Beam>,
}

/// Matrices of one shape, an element each.
fn blocks<const R: usize, const C: usize>(
    arrays: &Bound<'_, PyDict>,
    name: &str,
) -> PyResult<Vec<[[f64; C]; R]>> {
    let given = item(arrays, name)?;
    let given = real(name, &given)?;
    if given.shape().len() != 3 || given.shape()[1..] != [R, C] {
        return Err(PyValueError::new_err(format!("{name}: must have shape (n, {R}, {C})")));
    }
    check_finite(name, given.shape(), slice(&given))?;
    let rows = |block: &[f64]| std::array::from_fn(|r| std::array::from_fn(|c| block[C * r + c]));
    Ok(slice(&given).chunks_exact(R * C).map(rows).collect())
}

/// Vectors of one length, an element each.
fn vectors<const C: usize>(arrays: &Bound<'_, PyDict>, name: &str) -> PyResult<Vec<[f64; C]>> {
    let given = item(arrays, name)?;
    let given = real(name, &given)?;
    if given.shape().len() != 2 || given.shape()[1] != C {
        return Err(PyValueError::new_err(format!("{name}: must have shape (n, {C})")));
    }
    check_finite(name, given.shape(), slice(&given))?;
    let row = |block: &[f64]| std::array::from_fn(|c| block[c]);
    Ok(slice(&given).chunks_exact(C).map(row).collect())
}

fn item<'py>(arrays: &Bound<'py, PyDict>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    arrays.get_item(name)?.ok_or_else(|| PyValueError::new_err(format!("{name}: is missing")))
}

/// `rotation`: `("spin-up", speed, duration)`, `("table", times, speeds)` or a callable that gives
/// angle, speed and acceleration.
fn rotation_of(given: &Bound<'_, PyAny>) -> PyResult<Arc<dyn Prescribed>> {
    if given.is_callable() {
        return Ok(Arc::new(Called(given.clone().unbind())));
    }
    let (kind, one, two): (String, Bound<'_, PyAny>, Bound<'_, PyAny>) = given.extract()?;
    match kind.as_str() {
        "spin-up" => Ok(Arc::new(SpinUp { speed: one.extract()?, duration: two.extract()? })),
        "table" => {
            let (times, speeds) = (real("times", &one)?, real("speeds", &two)?);
            let table = Table::new(slice(&times).to_vec(), slice(&speeds).to_vec());
            Ok(Arc::new(table.map_err(to_python)?))
        }
        _ => Err(PyTypeError::new_err("rotation: unknown kind")),
    }
}

struct Called(Py<PyAny>);

impl Prescribed for Called {
    fn at(&self, t: f64) -> Result<[f64; 3]> {
        Python::attach(|py| {
            let found: [f64; 3] = self.0.call1(py, (t,))?.extract(py)?;
            if found.iter().any(|x| !x.is_finite()) {
                return Err(PyValueError::new_err(format!(
                    "rotation: angle, speed, acceleration are {found:?} at t = {t}"
                )));
            }
            Ok(found)
        })
        .map_err(from_python)
    }
}

/// Torques and forces by a callable `f(t, z) -> (hub, joint, tip, distributed)`.
struct CalledLoads {
    call: Py<PyAny>,
    follow: bool,
}

impl Loads for CalledLoads {
    fn follow(&self) -> bool {
        self.follow
    }

    fn at(&self, t: f64, z: &[f64], applied: &mut Applied) -> Result<()> {
        Python::attach(|py| {
            let state = convert::empty(py, &[z.len()])?;
            slice_mut(&state).copy_from_slice(z);
            let (hub, joint, tip, distributed): (f64, f64, [f64; 2], Option<Bound<'_, PyAny>>) =
                self.call.call1(py, (t, state))?.extract(py)?;
            (applied.hub, applied.joint, applied.tip) = (hub, joint, tip);
            applied.distributed.clear();
            if let Some(given) = distributed {
                let given = real("distributed_force", &given)?;
                let forces = slice(&given).chunks_exact(2).map(|f| [f[0], f[1]]);
                applied.distributed.extend(forces);
            }
            Ok(())
        })
        .map_err(from_python)
    }
}

#[pymethods]
impl RotatingBeam {
    /// `arrays`: matrices of elements; `hub`: `(inertia, spring)` with None for a locked joint, or
    /// None where the rotation is prescribed.
    #[new]
    #[pyo3(signature = (arrays, length, rule, moments, tip_inertia, coupling, hub, rotation, radius, ground_spring, gravity, damping, loads, follow))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        arrays: &Bound<'_, PyDict>,
        length: f64,
        rule: [[f64; POINTS]; 2],
        moments: [f64; 3],
        tip_inertia: f64,
        coupling: &str,
        hub: Option<(f64, Option<f64>)>,
        rotation: Option<&Bound<'_, PyAny>>,
        radius: f64,
        ground_spring: f64,
        gravity: [f64; 2],
        damping: [f64; 2],
        loads: Option<Py<PyAny>>,
        follow: bool,
    ) -> PyResult<Self> {
        let axial_stiffness = item(arrays, "axial_stiffness")?;
        let axial_stiffness = real("axial_stiffness", &axial_stiffness)?;
        let elements = Elements {
            length,
            axial_mass: blocks(arrays, "axial_mass")?,
            bending_mass: blocks(arrays, "bending_mass")?,
            gyroscopic: blocks(arrays, "gyroscopic")?,
            shortening: blocks(arrays, "shortening")?,
            pull: blocks(arrays, "pull")?,
            axial: vectors(arrays, "axial")?,
            axial_moment: vectors(arrays, "axial_moment")?,
            bending: vectors(arrays, "bending")?,
            bending_moment: vectors(arrays, "bending_moment")?,
            axial_stiffness: slice(&axial_stiffness).to_vec(),
            bending_stiffness: vectors(arrays, "bending_stiffness")?,
            rule,
            moments,
            tip_inertia,
        };
        let coupling = [Coupling::Zeroth, Coupling::First, Coupling::Third]
            .into_iter()
            .find(|known| known.name() == coupling)
            .ok_or_else(|| PyValueError::new_err("coupling: unknown"))?;
        let hub = match (hub, rotation) {
            (_, Some(rotation)) => Hub::Driven(rotation_of(rotation)?),
            (Some((inertia, None)), None) => Hub::Locked { inertia },
            (Some((inertia, Some(spring))), None) => Hub::Jointed { inertia, spring },
            (None, None) => return Err(PyValueError::new_err("hub or rotation is needed")),
        };
        let loads = loads.map(|call| -> Arc<dyn Loads> { Arc::new(CalledLoads { call, follow }) });
        let parameters =
            Parameters { hub, radius, ground_spring, coupling, gravity, damping, loads };
        let beam = Beam::new(&elements, parameters).map_err(to_python)?;
        Ok(RotatingBeam { beam: Arc::new(beam) })
    }

    /// Length of the state, with work and dissipation where they are kept.
    #[getter]
    fn size(&self) -> usize {
        self.beam.len()
    }

    /// An upper estimate of the largest natural frequency of the clamped beam, rad/s.
    #[getter]
    fn fastest(&self) -> f64 {
        self.beam.fastest()
    }

    /// Kinetic and potential energies of states (k, m) at times (k,) -> (k, 2).
    fn energies<'py>(
        &self,
        t: &Bound<'py, PyAny>,
        z: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.map(t, z, 2, |beam, t, z, out| {
            out.copy_from_slice(&beam.energies(t, z)?);
            Ok(())
        })
    }

    /// Rates `[q'; phi']` of states (k, m) at times (k,).
    fn rates<'py>(
        &self,
        t: &Bound<'py, PyAny>,
        z: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.map(t, z, self.beam.dof(), |beam, t, z, out| beam.rates(t, z, out))
    }

    /// States of rates: `[q; phi; q'; phi']` (k, m) at times (k,) -> `[q; phi; p]`.
    fn momenta<'py>(
        &self,
        t: &Bound<'py, PyAny>,
        z: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.map(t, z, self.beam.len(), |beam, t, z, out| {
            out.copy_from_slice(z);
            beam.momenta(t, out)
        })
    }

    /// `z'` of states (k, m) at times (k,).
    fn rate<'py>(
        &self,
        t: &Bound<'py, PyAny>,
        z: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.map(t, z, self.beam.len(), |beam, t, z, out| beam.rate(t, z, out))
    }
}

impl RotatingBeam {
    fn map<'py>(
        &self,
        t: &Bound<'py, PyAny>,
        z: &Bound<'py, PyAny>,
        width: usize,
        make: impl Fn(&Beam, f64, &[f64], &mut [f64]) -> Result<()> + Sync,
    ) -> PyResult<Bound<'py, PyAny>> {
        let beam = &*self.beam;
        states::map(beam.len(), t, z, width, |t, z, out| make(beam, t, z, out))
    }
}
