//! What the programs need of the board that QEMU plays: text and files through semihosting, an instruction count,
//! the painted stack. Free of `core::fmt`, whose number formatting would bring panics into the image.
#![no_std]

use core::panic::PanicInfo;

pub use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hio, nr, syscall};

pub use cortex_m_stack::{repaint_stack, stack_painted};

/// Reached by no program here: the linked images hold no path to it, and `measure` looks.
#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    exit(false)
}

/// Ends the program; QEMU's exit code is 0 or 1.
pub fn exit(good: bool) -> ! {
    loop {
        debug::exit(if good { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
    }
}

/// One line of text, put together in place and printed at once.
pub struct Line {
    bytes: [u8; 160],
    length: usize,
}

impl Line {
    /// An empty line.
    pub const fn new() -> Self {
        Self { bytes: [0; 160], length: 0 }
    }
    fn byte(&mut self, byte: u8) {
        if let Some(place) = self.bytes.get_mut(self.length) {
            *place = byte;
            self.length += 1;
        }
    }
    /// Adds text; what does not fit is cut off.
    pub fn text(&mut self, text: &str) -> &mut Self {
        text.bytes().for_each(|b| self.byte(b));
        self
    }
    /// Adds a number.
    pub fn number(&mut self, number: u32) -> &mut Self {
        let (mut digits, mut rest, mut count) = ([0u8; 10], number, 0);
        for digit in &mut digits {
            *digit = b'0' + (rest % 10) as u8;
            rest /= 10;
            count += 1;
            if rest == 0 {
                break;
            }
        }
        digits.iter().take(count).rev().for_each(|&d| self.byte(d));
        self
    }
    /// Adds a number with three decimals.
    pub fn decimal(&mut self, number: f32) -> &mut Self {
        if !number.is_finite() {
            return self.text("none");
        }
        let thousandths = (number.abs() * 1000.0 + 0.5) as u32;
        self.text(if number < 0.0 { "-" } else { "" }).number(thousandths / 1000).text(".");
        let rest = thousandths % 1000;
        self.text(if rest < 100 { "0" } else { "" }).text(if rest < 10 { "0" } else { "" }).number(rest)
    }
    /// Adds a word in eight hexadecimal digits.
    pub fn word(&mut self, word: u32) -> &mut Self {
        for shift in (0..32).step_by(4).rev() {
            let nibble = ((word >> shift) & 15) as u8;
            self.byte(if nibble < 10 { b'0' + nibble } else { b'a' + nibble - 10 });
        }
        self
    }
    /// Prints it and empties it.
    pub fn print(&mut self) {
        self.byte(b'\n');
        write(self.bytes.get(..self.length).unwrap_or(&[]));
        self.length = 0;
    }
}

impl Default for Line {
    fn default() -> Self {
        Self::new()
    }
}

/// Bytes to the host's standard output.
pub fn write(bytes: &[u8]) {
    if let Ok(mut out) = hio::hstdout() {
        let _ = out.write_all(bytes);
    }
}

/// A file on the host, read through semihosting.
pub struct HostFile(usize);

impl HostFile {
    /// Opens it for reading. `name` ends with a zero byte.
    pub fn open(name: &[u8]) -> Option<Self> {
        let length = name.len().checked_sub(1)?;
        // SAFETY: SYS_OPEN reads `length` bytes and the terminating zero, all within `name`.
        let handle = unsafe { syscall!(OPEN, name.as_ptr(), nr::open::R_BINARY, length) };
        (handle != usize::MAX).then_some(Self(handle))
    }
    /// Reads up to a full buffer; the bytes read, 0 at the end.
    pub fn read(&mut self, into: &mut [u8]) -> usize {
        // SAFETY: SYS_READ writes at most `into.len()` bytes to `into`, which is ours alone.
        let missing = unsafe { syscall!(READ, self.0, into.as_mut_ptr(), into.len()) };
        into.len().saturating_sub(missing)
    }
}

/// The SysTick timer as a counter of instructions: under `-icount` its ticks are a fixed multiple of them.
pub mod clock {
    use cortex_m::peripheral::SYST;
    use cortex_m::peripheral::syst::SystClkSource;

    /// Starts it, at its longest period (2^24 ticks).
    pub fn start() {
        if let Some(mut core) = cortex_m::Peripherals::take() {
            core.SYST.set_clock_source(SystClkSource::Core);
            core.SYST.set_reload(0x00ff_ffff);
            core.SYST.clear_current();
            core.SYST.enable_counter();
        }
    }

    /// Ticks that `work` takes, the reading itself included.
    #[inline(always)]
    pub fn time(work: impl FnOnce()) -> u32 {
        let before = SYST::get_current();
        work();
        let after = SYST::get_current();
        before.wrapping_sub(after) & 0x00ff_ffff
    }
}
