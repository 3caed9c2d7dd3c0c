//! Results that tests plan for calls of the window system, so that what follows can be tested without a faulty driver.

use std::str::FromStr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ash::vk;

/// A call of the window system whose result can be planned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WindowCall {
    /// `vkCreateSurfaceKHR` of the window system.
    Surface,
    /// `vkCreateSwapchainKHR`.
    Swapchain,
    /// `vkAcquireNextImageKHR`.
    Acquire,
    /// `vkQueuePresentKHR`.
    Present,
}

/// The result that some calls will have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WindowFault {
    /// The call.
    pub call: WindowCall,
    /// Number of calls before that, which go as they go.
    pub after: u64,
    /// Number of calls in a row that have the result.
    pub times: u64,
    /// The result.
    pub result: vk::Result,
}

/// The results that can be planned: those that the specification lists for these calls.
const RESULTS: [vk::Result; 11] = [
    vk::Result::NOT_READY,
    vk::Result::SUBOPTIMAL_KHR,
    vk::Result::ERROR_OUT_OF_HOST_MEMORY,
    vk::Result::ERROR_OUT_OF_DEVICE_MEMORY,
    vk::Result::ERROR_INITIALIZATION_FAILED,
    vk::Result::ERROR_DEVICE_LOST,
    vk::Result::ERROR_SURFACE_LOST_KHR,
    vk::Result::ERROR_NATIVE_WINDOW_IN_USE_KHR,
    vk::Result::ERROR_OUT_OF_DATE_KHR,
    vk::Result::ERROR_FULL_SCREEN_EXCLUSIVE_MODE_LOST_EXT,
    vk::Result::ERROR_UNKNOWN,
];

impl FromStr for WindowFault {
    type Err = String;

    /// Reads `CALL,AFTER,TIMES,RESULT`, such as `acquire,20,1,ERROR_SURFACE_LOST_KHR`.
    fn from_str(text: &str) -> Result<Self, String> {
        let parts: Vec<&str> = text.split(',').collect();
        let [call, after, times, result] = parts[..] else {
            return Err("expected CALL,AFTER,TIMES,RESULT".into());
        };
        let call = match call {
            "surface" => WindowCall::Surface,
            "swapchain" => WindowCall::Swapchain,
            "acquire" => WindowCall::Acquire,
            "present" => WindowCall::Present,
            _ => return Err(format!("{call} is none of surface, swapchain, acquire and present")),
        };
        let number = |text: &str| text.parse().map_err(|_| format!("{text} is no number of calls"));
        let known = RESULTS.into_iter().find(|known| format!("{known:?}") == result);
        let result = known.ok_or_else(|| format!("{result} is none of {RESULTS:?}"))?;
        Ok(Self { call, after: number(after)?, times: number(times)?, result })
    }
}

/// What is planned for a window, and what has happened. Clones share it: it outlives devices and surfaces.
#[derive(Clone, Debug, Default)]
pub struct WindowFaults(Arc<Mutex<FaultPlan>>);

#[derive(Debug, Default)]
struct FaultPlan {
    planned: Vec<WindowFault>,
    /// Number of calls of each kind so far.
    calls: [u64; 4],
}

impl WindowFaults {
    /// These faults.
    pub fn of(faults: &[WindowFault]) -> Self {
        Self(Arc::new(Mutex::new(FaultPlan { planned: faults.to_vec(), calls: [0; 4] })))
    }

    fn locked(&self) -> MutexGuard<'_, FaultPlan> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Plans a result.
    pub fn plan(&self, fault: WindowFault) {
        self.locked().planned.push(fault);
    }

    /// Number of calls so far, those that have failed as planned included.
    pub fn calls(&self, call: WindowCall) -> u64 {
        self.locked().calls[call as usize]
    }

    /// Counts a call; the result that it is to have instead of its own.
    pub(in crate::gpu) fn next(&self, call: WindowCall) -> Option<vk::Result> {
        let FaultPlan { planned, calls } = &mut *self.locked();
        calls[call as usize] += 1;
        let mut result = None;
        for fault in planned.iter_mut().filter(|fault| fault.call == call) {
            if fault.after > 0 {
                fault.after -= 1;
            } else if result.is_none() {
                fault.times = fault.times.saturating_sub(1);
                result = Some(fault.result);
            }
        }
        planned.retain(|fault| fault.after > 0 || fault.times > 0);
        result
    }

    /// As [`next`](Self::next), as the error of a call that makes something.
    pub(in crate::gpu) fn check(&self, call: WindowCall) -> Result<(), vk::Result> {
        self.next(call).map_or(Ok(()), Err)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_come_when_they_are_planned() {
        let faults = WindowFaults::default();
        for text in ["acquire,1,2,ERROR_SURFACE_LOST_KHR", "acquire,0,1,SUBOPTIMAL_KHR"] {
            faults.plan(text.parse().expect(text));
        }
        assert_eq!(faults.next(WindowCall::Present), None);
        let lost = Some(vk::Result::ERROR_SURFACE_LOST_KHR);
        let seen = [(); 4].map(|()| faults.next(WindowCall::Acquire));
        assert_eq!(faults.calls(WindowCall::Acquire), 4);
        assert_eq!(seen, [Some(vk::Result::SUBOPTIMAL_KHR), lost, lost, None]);
        for wrong in ["acquire", "draw,0,1,ERROR_UNKNOWN", "present,x,1,ERROR_UNKNOWN", "present,0,1,OOM"] {
            assert!(wrong.parse::<WindowFault>().is_err(), "{wrong}");
        }
    }
}
