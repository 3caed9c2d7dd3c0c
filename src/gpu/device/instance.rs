//! The Vulkan instance, the validation layer and its messages.

use std::ffi::{CStr, CString, c_char, c_void};
use std::sync::Mutex;

use ash::{ext, vk};
use raw_window_handle::RawDisplayHandle;

use crate::gpu::error::{GpuError, Named};

const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// Messages of the validation layer, oldest first.
type Messages = Mutex<Vec<String>>;

/// Owns the loader, the instance and, where the extension exists, the debug messenger.
pub(in crate::gpu) struct VulkanInstance {
    /// Keeps the loader's library open.
    pub entry: ash::Entry,
    pub raw: ash::Instance,
    /// True when objects and commands can be named.
    pub names: bool,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    /// Boxed: the messenger holds its address.
    messages: Box<Messages>,
}

impl VulkanInstance {
    /// Loads Vulkan and creates an instance of version 1.3, with the extensions for windows of `display` if given.
    pub fn new(validation: bool, display: Option<RawDisplayHandle>) -> Result<Self, GpuError> {
        // SAFETY: the loader is the system's Vulkan library; its initialisers are trusted as any system library's.
        let entry = unsafe { ash::Entry::load() }.map_err(|e| GpuError::NoLoader(e.to_string()))?;
        // SAFETY: plain query.
        let layers = unsafe { entry.enumerate_instance_layer_properties() }.unwrap_or_default();
        let has = |name: &CStr| layers.iter().any(|l| l.layer_name_as_c_str() == Ok(name));
        if validation && !has(VALIDATION_LAYER) {
            return Err(GpuError::NoValidationLayer);
        }
        // SAFETY: plain query.
        let offered = unsafe { entry.enumerate_instance_extension_properties(None) }.unwrap_or_default();
        let offers = |name: &CStr| offered.iter().any(|e| e.extension_name_as_c_str() == Ok(name));
        let names = offers(ext::debug_utils::NAME);

        let mut extensions = match display {
            Some(display) => for_windows(display, offers)?,
            None => Vec::new(),
        };
        let mut enabled_layers: Vec<*const c_char> = Vec::new();
        if names {
            extensions.push(ext::debug_utils::NAME.as_ptr());
        }
        if validation {
            extensions.push(ext::validation_features::NAME.as_ptr());
            enabled_layers.push(VALIDATION_LAYER.as_ptr());
        }
        let app = vk::ApplicationInfo::default()
            .application_name(c"pointillist")
            .engine_name(c"pointillist")
            .api_version(vk::API_VERSION_1_3);
        let checks = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
        let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&checks);
        let mut info = vk::InstanceCreateInfo::default()
            .application_info(&app)
            .enabled_layer_names(&enabled_layers)
            .enabled_extension_names(&extensions);
        if validation {
            info = info.push_next(&mut features);
        }
        // SAFETY: every pointer in `info` outlives the call; layers and extensions were enumerated above.
        let raw = unsafe { entry.create_instance(&info, None) }.map_err(|result| match result {
            vk::Result::ERROR_INCOMPATIBLE_DRIVER => GpuError::NoDevice,
            result => GpuError::Call { call: "vkCreateInstance".into(), result },
        })?;
        let mut this = VulkanInstance { entry, raw, names, messenger: None, messages: Box::default() };
        if names && validation {
            this.listen()?;
        }
        Ok(this)
    }

    /// Sends the layer's warnings and errors to `messages` and to the log.
    fn listen(&mut self) -> Result<(), GpuError> {
        let address: *const Messages = &*self.messages;
        let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(
                vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
            )
            .message_type(
                vk::DebugUtilsMessageTypeFlagsEXT::GENERAL
                    | vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION
                    | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE,
            )
            .pfn_user_callback(Some(on_message))
            .user_data(address.cast_mut().cast());
        let loader = ext::debug_utils::Instance::new(&self.entry, &self.raw);
        // SAFETY: the callback's user data is the boxed list, which lives until after the messenger is destroyed.
        let messenger = unsafe { loader.create_debug_utils_messenger(&info, None) }
            .named("vkCreateDebugUtilsMessengerEXT")?;
        self.messenger = Some((loader, messenger));
        Ok(())
    }

    /// All messages of the validation layer so far.
    pub fn messages(&self) -> Vec<String> {
        self.messages.lock().map(|m| m.clone()).unwrap_or_default()
    }
}

impl Drop for VulkanInstance {
    fn drop(&mut self) {
        // SAFETY: `Gpu` and `Surface` hold the instance and destroy what they made of it before they let go of it.
        unsafe {
            if let Some((loader, messenger)) = self.messenger.take() {
                loader.destroy_debug_utils_messenger(messenger, None);
            }
            self.raw.destroy_instance(None);
        }
    }
}

/// Names objects and commands for debuggers and messages, where the extension exists.
pub(in crate::gpu) struct DebugNames(Option<ext::debug_utils::Device>);

impl DebugNames {
    pub fn new(instance: &VulkanInstance, device: &ash::Device) -> Self {
        Self(instance.names.then(|| ext::debug_utils::Device::new(&instance.raw, device)))
    }

    /// Names an object of the device.
    pub fn name(&self, handle: impl vk::Handle, name: &str) {
        if let (Some(debug), Ok(name)) = (&self.0, CString::new(name)) {
            let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&name);
            // SAFETY: the handle belongs to this device; a failure only costs the name.
            let _ = unsafe { debug.set_debug_utils_object_name(&info) };
        }
    }

    /// Begins a labelled part of a command buffer that is being recorded.
    pub fn begin_label(&self, commands: vk::CommandBuffer, name: &str) {
        if let (Some(debug), Ok(name)) = (&self.0, CString::new(name)) {
            let label = vk::DebugUtilsLabelEXT::default().label_name(&name);
            // SAFETY: the command buffer is being recorded.
            unsafe { debug.cmd_begin_debug_utils_label(commands, &label) };
        }
    }

    /// Ends the part that was begun last.
    pub fn end_label(&self, commands: vk::CommandBuffer) {
        if let Some(debug) = &self.0 {
            // SAFETY: every label was begun by `begin_label`.
            unsafe { debug.cmd_end_debug_utils_label(commands) };
        }
    }
}

/// Extensions needed for windows of `display`, and the one for colour spaces beyond sRGB if available.
fn for_windows(
    display: RawDisplayHandle,
    offers: impl Fn(&CStr) -> bool,
) -> Result<Vec<*const c_char>, GpuError> {
    let needed = ash_window::enumerate_required_extensions(display)
        .map_err(|_| GpuError::NoWindow("windows of this system are not known to it.".into()))?;
    let mut extensions = needed.to_vec();
    // SAFETY: the list holds names that are compiled in.
    let missing = needed.iter().map(|name| unsafe { CStr::from_ptr(*name) }).find(|name| !offers(name));
    if let Some(name) = missing {
        let name = name.to_string_lossy();
        return Err(GpuError::NoWindow(format!(
            "the extension {name} is missing: update the graphics driver."
        )));
    }
    if offers(ext::swapchain_colorspace::NAME) {
        extensions.push(ext::swapchain_colorspace::NAME.as_ptr());
    }
    Ok(extensions)
}

/// Called by the layer, possibly from several threads.
unsafe extern "system" fn on_message(
    severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: Vulkan hands over valid callback data; its message is a C string or null.
    let text = unsafe { data.as_ref() }
        .filter(|d| !d.p_message.is_null())
        // SAFETY: not null, and a C string by the specification.
        .map(|d| unsafe { CStr::from_ptr(d.p_message) }.to_string_lossy().into_owned())
        .unwrap_or_default();
    if severity.contains(vk::DebugUtilsMessageSeverityFlagsEXT::ERROR) {
        tracing::error!(target: "vulkan", "{text}");
    } else {
        tracing::warn!(target: "vulkan", "{text}");
    }
    // SAFETY: `user` is the list boxed in `VulkanInstance`, which outlives the messenger.
    if let Some(messages) = unsafe { user.cast::<Messages>().as_ref() }
        && let Ok(mut messages) = messages.lock()
    {
        messages.push(text);
    }
    vk::FALSE
}
