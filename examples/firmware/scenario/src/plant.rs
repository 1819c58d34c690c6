//! A first-order plant with a noisy sensor, a load, and an actuator whose gain fades.

/// Uniform noise from a 32-bit xorshift (Marsaglia 2003): the same on every machine.
#[derive(Debug, Clone, Copy)]
pub struct Noise(u32);

impl Noise {
    /// `seed` is not zero.
    pub const fn new(seed: u32) -> Self {
        Self(seed)
    }
    /// 32 random bits.
    pub fn bits(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0
    }
    /// Uniform in -1..1.
    pub fn uniform(&mut self) -> f32 {
        (self.bits() >> 8) as f32 * (1.0 / 8_388_608.0) - 1.0
    }
}

/// `dx/dt = (gain*u - load - x)/0.05 s`, stepped with 1 ms; y is x with noise.
#[derive(Debug, Clone, Copy)]
pub struct Plant {
    x: f32,
    noise: Noise,
    /// The actuator's gain; 1 is healthy.
    pub gain: f32,
    /// Subtracted from the drive.
    pub load: f32,
}

impl Plant {
    /// At rest.
    pub const fn new(seed: u32) -> Self {
        Self { x: 0.0, noise: Noise::new(seed), gain: 1.0, load: 0.0 }
    }
    /// The sensor's reading.
    pub fn measure(&mut self) -> f32 {
        self.x + 0.02 * self.noise.uniform()
    }
    /// One tick under `u`.
    pub fn drive(&mut self, u: f32) {
        self.x += (self.gain * u - self.load - self.x) * 0.02;
    }
}

/// A reference that wanders between levels: without it no curve can be learnt.
#[derive(Debug, Clone, Copy)]
pub struct Reference {
    noise: Noise,
    level: f32,
}

impl Reference {
    /// Around 1.
    pub const fn new(seed: u32) -> Self {
        Self { noise: Noise::new(seed), level: 1.0 }
    }
    /// The next tick's value: a new level every 50 ticks.
    pub fn at(&mut self, tick: u32) -> f32 {
        if tick.is_multiple_of(50) {
            self.level = 1.0 + 0.3 * self.noise.uniform();
        }
        self.level
    }
}
