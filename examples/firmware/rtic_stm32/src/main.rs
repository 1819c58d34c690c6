//! drift in an RTIC application for the STM32F411 (Nucleo, Black Pill): the control interrupt of timer 2 reads the
//! sensor, runs the PI, drives the PWM and ticks the monitor; its report goes to a task of lower priority.
#![no_std]
#![no_main]

use panic_halt as _;

#[rtic::app(device = stm32f4xx_hal::pac, dispatchers = [EXTI0])]
mod app {
    use drift_core::Verdict;
    use rtic_sync::{channel::*, make_channel};
    use scenario::pi::Pi;
    use scenario::{PAIR_F32, PairF32, PairReport};
    use stm32f4xx_hal::adc::Adc;
    use stm32f4xx_hal::adc::config::{AdcConfig, SampleTime};
    use stm32f4xx_hal::gpio::{Analog, Output, PA0, PC13};
    use stm32f4xx_hal::pac::{ADC1, TIM2, TIM3};
    use stm32f4xx_hal::prelude::*;
    use stm32f4xx_hal::rcc::Config;
    use stm32f4xx_hal::timer::{CounterHz, Event, PwmChannel};

    #[shared]
    struct Shared {}

    #[local]
    struct Local {
        timer: CounterHz<TIM2>,
        adc: Adc<ADC1>,
        sensor: PA0<Analog>,
        drive: PwmChannel<TIM3, 0>,
        pi: Pi,
        monitor: PairF32,
        reports: Sender<'static, PairReport, 2>,
        lamp: PC13<Output>,
    }

    #[init]
    fn init(context: init::Context) -> (Shared, Local) {
        let device = context.device;
        let mut rcc = device.RCC.freeze(Config::hsi().sysclk(84.MHz()));
        let (a, c) = (device.GPIOA.split(&mut rcc), device.GPIOC.split(&mut rcc));
        let adc = Adc::new(device.ADC1, true, AdcConfig::default(), &mut rcc);
        let (_, (pwm, ..)) = device.TIM3.pwm_hz(20.kHz(), &mut rcc);
        let mut drive = pwm.with(a.pa6);
        drive.enable();
        let mut timer = device.TIM2.counter_hz(&mut rcc);
        // 1 kHz divides the clock: it can't fail, and if it did the loop would not run.
        let _ = timer.start(1.kHz());
        timer.listen(Event::Update);
        let (reports, receiver) = make_channel!(PairReport, 2);
        let _ = tell::spawn(receiver);
        let pi = Pi { kp: 2.0, ki_ts: 0.01, u_min: 0.0, u_max: 1.0, integral: 0.0 };
        let local = Local {
            timer,
            adc,
            sensor: a.pa0.into_analog(),
            drive,
            pi,
            monitor: PAIR_F32.start(),
            reports,
            lamp: c.pc13.into_push_pull_output(),
        };
        (Shared {}, local)
    }

    /// The control loop, every millisecond. A report that nobody fetched in time is dropped: the next one says the
    /// same if it still holds.
    #[task(binds = TIM2, priority = 2, local = [timer, adc, sensor, drive, pi, monitor, reports])]
    fn control(context: control::Context) {
        let local = context.local;
        local.timer.clear_all_flags();
        let r = 0.5;
        let y = f32::from(local.adc.convert(local.sensor, SampleTime::Cycles_56)) * (1.0 / 4096.0);
        let u = local.pi.tick(r, y);
        let full = f32::from(local.drive.get_max_duty());
        local.drive.set_duty((u * full) as u16);
        if let Some(report) = PAIR_F32.tick(local.monitor, r, y, u) {
            let _ = local.reports.try_send(*report);
        }
    }

    /// Whoever acts on it: here a lamp (active low).
    #[task(priority = 1, local = [lamp])]
    async fn tell(context: tell::Context, mut reports: Receiver<'static, PairReport, 2>) {
        while let Ok(report) = reports.recv().await {
            if report.verdict == Verdict::Drift {
                context.local.lamp.set_low();
            } else {
                context.local.lamp.set_high();
            }
        }
    }
}
