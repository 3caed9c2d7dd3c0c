//! Plans of faults.

use std::str::FromStr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ash::vk;

use super::{CallFaults, DeviceCall};

impl DeviceCall {
    /// Its name on the command line.
    const NAMES: [(Self, &str); 7] = [
        (Self::Surface, "surface"),
        (Self::Swapchain, "swapchain"),
        (Self::Acquire, "acquire"),
        (Self::Present, "present"),
        (Self::Allocation, "allocation"),
        (Self::Mapping, "mapping"),
        (Self::Pipeline, "pipeline"),
    ];
}

/// A planned result of some calls.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CallFault {
    /// The call.
    pub call: DeviceCall,
    /// Number of unaffected calls before.
    pub after: u64,
    /// Number of consecutive affected calls.
    pub times: u64,
    /// The result.
    pub result: vk::Result,
}

/// Allowed results: those that the specification lists for these calls.
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

impl FromStr for CallFault {
    type Err = String;

    /// Reads `CALL,AFTER,TIMES,RESULT`, such as `acquire,20,1,ERROR_SURFACE_LOST_KHR`.
    fn from_str(text: &str) -> Result<Self, String> {
        let parts: Vec<&str> = text.split(',').collect();
        let [call, after, times, result] = parts[..] else {
            return Err("expected CALL,AFTER,TIMES,RESULT".into());
        };
        let known = DeviceCall::NAMES.into_iter().find(|(_, name)| *name == call);
        let (call, _) = known.ok_or_else(|| {
            format!("{call} is none of {}", DeviceCall::NAMES.map(|(_, name)| name).join(", "))
        })?;
        let number = |text: &str| text.parse().map_err(|_| format!("{text} is no number of calls"));
        let known = RESULTS.into_iter().find(|known| format!("{known:?}") == result);
        let result = known.ok_or_else(|| format!("{result} is none of {RESULTS:?}"))?;
        Ok(Self { call, after: number(after)?, times: number(times)?, result })
    }
}

/// The plan that clones share.
pub(super) type SharedCalls = Arc<Mutex<PlannedCalls>>;

#[derive(Debug, Default)]
pub struct PlannedCalls {
    planned: Vec<CallFault>,
    /// Number of calls of each kind.
    calls: [u64; DeviceCall::NAMES.len()],
}

impl CallFaults {
    /// Plans these faults.
    pub fn of(faults: &[CallFault]) -> Self {
        let faults = PlannedCalls { planned: faults.to_vec(), ..PlannedCalls::default() };
        Self(Arc::new(Mutex::new(faults)))
    }

    fn locked(&self) -> MutexGuard<'_, PlannedCalls> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Plans a fault.
    pub fn plan(&self, fault: CallFault) {
        self.locked().planned.push(fault);
    }

    /// Lets `count` more of these calls succeed and fails all later ones, as if memory were exhausted; `u64::MAX` lets all succeed and
    /// cancels other faults planned for them.
    pub fn fail_after(&self, call: DeviceCall, count: u64) {
        let planned = &mut self.locked().planned;
        planned.retain(|fault| fault.call != call);
        if count < u64::MAX {
            let result = vk::Result::ERROR_OUT_OF_DEVICE_MEMORY;
            planned.push(CallFault { call, after: count, times: u64::MAX, result });
        }
    }

    /// Number of calls so far, including those that failed as planned.
    pub fn calls(&self, call: DeviceCall) -> u64 {
        self.locked().calls[call as usize]
    }

    pub(super) fn next_planned(&self, call: DeviceCall) -> Option<vk::Result> {
        let PlannedCalls { planned, calls } = &mut *self.locked();
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
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_come_when_they_are_planned() {
        let faults = CallFaults::default();
        for text in ["acquire,1,2,ERROR_SURFACE_LOST_KHR", "acquire,0,1,SUBOPTIMAL_KHR"] {
            faults.plan(text.parse().expect(text));
        }
        assert_eq!(faults.next(DeviceCall::Present), None);
        let lost = Some(vk::Result::ERROR_SURFACE_LOST_KHR);
        let seen = [(); 4].map(|()| faults.next(DeviceCall::Acquire));
        assert_eq!(faults.calls(DeviceCall::Acquire), 4);
        assert_eq!(seen, [Some(vk::Result::SUBOPTIMAL_KHR), lost, lost, None]);
        faults.fail_after(DeviceCall::Mapping, 1);
        let seen = [(); 3].map(|()| faults.check(DeviceCall::Mapping).is_ok());
        assert_eq!(seen, [true, false, false]);
        faults.fail_after(DeviceCall::Mapping, u64::MAX);
        assert!(faults.check(DeviceCall::Mapping).is_ok());
        for wrong in ["acquire", "draw,0,1,ERROR_UNKNOWN", "present,x,1,ERROR_UNKNOWN", "present,0,1,OOM"] {
            assert!(wrong.parse::<CallFault>().is_err(), "{wrong}");
        }
    }
}
