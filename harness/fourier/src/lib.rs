//! Discrete Fourier transforms of real signals of one length N, not normalised:
//!
//! ```text
//! X_k = Σ_n x_n e^{−j2πkn/N},   k = 0 … N/2
//! ```
//!
//! The generic crate `realfft` is used only here, so that its code is compiled only once.

use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError};

use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

pub use realfft::num_complex::Complex64;

/// Returns the planner of the Fourier transforms of this process. It caches its tables, because
/// preparing a transform takes longer than computing it.
fn planner() -> MutexGuard<'static, RealFftPlanner<f64>> {
    static PLANNER: LazyLock<Mutex<RealFftPlanner<f64>>> = LazyLock::new(Default::default);
    PLANNER.lock().unwrap_or_else(PoisonError::into_inner)
}

pub struct Forward(Arc<dyn RealToComplex<f64>>);

impl Forward {
    pub fn new(length: usize) -> Self {
        Forward(planner().plan_fft_forward(length))
    }

    /// Returns the spectrum of a real signal of N samples, which has N/2 + 1 lines from frequency 0
    /// to half the sampling frequency.
    ///
    /// # Panics
    /// If the signal has another length than the transform.
    pub fn transform(&self, mut signal: Vec<f64>) -> Vec<Complex64> {
        let mut spectrum = self.0.make_output_vec();
        self.0.process(&mut signal, &mut spectrum).expect("a signal of the transform's length");
        spectrum
    }
}

pub struct Inverse(Arc<dyn ComplexToReal<f64>>);

impl Inverse {
    pub fn new(length: usize) -> Self {
        Inverse(planner().plan_fft_inverse(length))
    }

    /// Returns N times the real signal of N samples that belongs to `spectrum`, which has N/2 + 1
    /// lines. Imaginary parts of line 0 and, if N is even, of the last line are ignored, because
    /// the spectrum of a real signal has none.
    ///
    /// # Panics
    /// If the spectrum has another length.
    pub fn transform(&self, mut spectrum: Vec<Complex64>) -> Vec<f64> {
        let last = spectrum.len() - 1;
        spectrum[0].im = 0.0;
        if self.0.len().is_multiple_of(2) {
            spectrum[last].im = 0.0;
        }
        let mut signal = self.0.make_output_vec();
        self.0.process(&mut spectrum, &mut signal).expect("a spectrum of the transform's length");
        signal
    }
}
