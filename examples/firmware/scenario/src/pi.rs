//! The controller that the monitor is linked into, and against whose cost its own is held: a plain PI with
//! clipping and anti-windup.

/// `i += ki_ts*e; u = kp*e + i`, clipped; while clipped, the integral does not move further out.
#[derive(Debug, Clone, Copy)]
pub struct Pi {
    /// Proportional gain.
    pub kp: f32,
    /// Integral gain times the sample time.
    pub ki_ts: f32,
    /// Lower limit of u.
    pub u_min: f32,
    /// Upper limit of u.
    pub u_max: f32,
    /// The integral.
    pub integral: f32,
}

impl Pi {
    /// One tick.
    #[inline(always)]
    pub fn tick(&mut self, r: f32, y: f32) -> f32 {
        let e = r - y;
        let integral = self.integral + self.ki_ts * e;
        let u = self.kp * e + integral;
        if u > self.u_max {
            if e < 0.0 {
                self.integral = integral;
            }
            return self.u_max;
        }
        if u < self.u_min {
            if e > 0.0 {
                self.integral = integral;
            }
            return self.u_min;
        }
        self.integral = integral;
        u
    }
}

/// The same in counts, gains in 1/256: for parts without an FPU.
#[derive(Debug, Clone, Copy)]
pub struct PiCounts {
    /// Proportional gain, 1/256.
    pub kp: i32,
    /// Integral gain times the sample time, 1/256.
    pub ki_ts: i32,
    /// Limit of |u|, counts.
    pub u_max: i32,
    /// The integral, counts/256.
    pub integral: i32,
}

impl PiCounts {
    /// One tick.
    #[inline(always)]
    pub fn tick(&mut self, r: i32, y: i32) -> i32 {
        let e = r.wrapping_sub(y);
        let integral = self.integral.wrapping_add(self.ki_ts.wrapping_mul(e));
        let u = self.kp.wrapping_mul(e).wrapping_add(integral) >> 8;
        if u > self.u_max {
            if e < 0 {
                self.integral = integral;
            }
            return self.u_max;
        }
        if u < -self.u_max {
            if e > 0 {
                self.integral = integral;
            }
            return -self.u_max;
        }
        self.integral = integral;
        u
    }
}
