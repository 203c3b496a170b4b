//! Canonical text of everything that a scheme's verdicts depend on: input for the choice of primes.

use obsdeg_exact::SplitMix64;

use super::scheme::Scheme;

impl Scheme {
    /// Random stream of `seed` for one purpose and this scheme ([`SplitMix64::of`]). It depends on the whole
    /// scheme except for what changes no verdict: names and descriptions, numbers of a simulation,
    /// requirements and gimbals.
    /// gimbals.
    pub fn random(&self, seed: u64, purpose: &str) -> SplitMix64 {
        SplitMix64::of(seed, purpose, &self.canonical())
    }

    /// Canonical parts of the scheme, lists with their length: the same for the same scheme, however it was
    /// written.
    fn canonical(&self) -> Vec<String> {
        let mut out = vec![
            "scheme".into(),
            self.carry.to_string(),
            self.latitude.map_or_else(|| "generic".into(), |l| l.to_string()),
            self.unknowns.to_string(),
            self.measured_azimuth.to_string(),
        ];
        for gyro in self.geometry.gyros() {
            out.extend([gyro.I, gyro.O, gyro.S].map(|axis| axis.to_string()));
        }
        if !self.geometry.accelerometers.is_default() {
            out.extend(self.geometry.accelerometers.inputs().map(|axis| format!("accelerometer {axis}")));
        }
        // the slew path counts where a verdict depends on it
        if let Ok(paths) = self.paths() {
            out.extend(paths.iter().flatten().map(ToString::to_string));
        }
        out.push(self.positions.len().to_string());
        for p in &self.positions {
            out.push(super::attitude::angles_text(&p.angles));
            out.push(p.rotation.as_ref().map_or_else(String::new, ToString::to_string));
            out.push(p.dwell.map_or_else(String::new, |d| d.to_string()));
        }
        out.extend(self.combinations.iter().cloned());
        out
    }
}

#[cfg(test)]
mod tests {
    use crate::model::scheme_file;

    /// A different notation of a scheme changes no prime; every change of the judged scheme does.
    #[test]
    fn what_is_judged_takes_part() {
        let first = |text: &str| {
            let scheme = scheme_file::read(text).unwrap_or_else(|e| panic!("{}: {text}", e.message));
            scheme.random(1, "verdicts").next_u64()
        };
        let plain = "[[position]]\nangles_deg = [0, 0, 0]\n[[position]]\nangles_deg = [180, 0, 0]\n";
        let words = "name = 'A'\n[[position]]\nname = 'a'\nangles_deg = [0.0, 0, \
                     0]\n[[position]]\nangles_deg = ['180', 0, 0]\n";
        assert_eq!(first(plain), first(words));
        let mut seen = vec![first(plain)];
        for other in [
            "carry = 'inertial'",
            "latitude_deg = 28.2",
            "terms = ['F', 'I']",
            "measured_azimuth = true",
            "combinations = ['D_FX']",
            "combinations = ['D_FX', 'D_FY']",
            "combinations = ['2*D_FX']",
            "geometry = { X = { I = '+x', O = '+z', S = '-y' }, Y = { I = '+y', O = '-z', S = '-x' }, Z = \
             { I = '+z', O = '+x', S = '+y' } }",
        ] {
            seen.push(first(&format!("{other}\n{plain}")));
        }
        for other in ["dwell_s = 500", "rotation = { about = 'X_p', angle_deg = 360 }"] {
            seen.push(first(&format!("{plain}{other}\n")));
        }
        seen.push(first(&plain.replace("180", "180.000000001")));
        let all = seen.len();
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen.len(), all);
    }
}
