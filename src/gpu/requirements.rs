//! What the renderer needs of a device, as data: queryable before there is one, checkable, and mergeable into the host's own
//! feature structs. The only place with feature bits.

use ash::vk;

/// Baseline: Vulkan 1.3 core with dynamic rendering and synchronization2. No descriptor indexing, no 16-bit shader types, no
/// sampler anisotropy, no optional storage formats.
#[derive(Clone, Debug)]
pub struct Requirements {
    /// Device API version.
    pub api_version: u32,
    /// Queue capabilities of one family.
    pub queue: vk::QueueFlags,
    /// Formats and what they are used for (optimal tiling).
    pub formats: Vec<(vk::Format, vk::FormatFeatureFlags)>,
    /// Limits by name and least value.
    pub limits: Vec<(&'static str, u64)>,
}

/// One requirement held against a device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Row {
    /// What is required, as the Vulkan specification writes it.
    pub name: String,
    /// What is needed.
    pub needed: String,
    /// What the device has.
    pub found: String,
    /// Whether that suffices.
    pub ok: bool,
}

/// Everything that a device lacks.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}", .0.iter().map(|r| format!("{} must be {}, is {}", r.name, r.needed, r.found)).collect::<Vec<_>>().join("; "))]
pub struct Missing(pub Vec<Row>);

impl From<Missing> for crate::Error {
    fn from(missing: Missing) -> Self {
        Self::MissingRequirements(missing.to_string())
    }
}

impl Requirements {
    /// What a renderer of `config` needs.
    pub fn of(config: &crate::Config) -> Self {
        use vk::FormatFeatureFlags as F;
        let plan = crate::plan::Plan::of(config);
        let [width, height] = plan.shading;
        let sampled = F::SAMPLED_IMAGE;
        let filtered = F::SAMPLED_IMAGE | F::SAMPLED_IMAGE_FILTER_LINEAR;
        Self {
            api_version: vk::API_VERSION_1_3,
            queue: vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE,
            formats: vec![
                (vk::Format::R32G32B32A32_SFLOAT, filtered | F::STORAGE_IMAGE | F::COLOR_ATTACHMENT),
                (vk::Format::R16G16B16A16_SFLOAT, sampled | F::STORAGE_IMAGE),
                (vk::Format::R32G32B32A32_UINT, sampled),
                (vk::Format::R32_SFLOAT, sampled | F::STORAGE_IMAGE),
                (vk::Format::R32_UINT, sampled | F::COLOR_ATTACHMENT),
                (vk::Format::R32G32_SFLOAT, sampled | F::COLOR_ATTACHMENT),
                (vk::Format::R16_SFLOAT, filtered),
                (vk::Format::E5B9G9R9_UFLOAT_PACK32, filtered),
                (vk::Format::D32_SFLOAT, F::DEPTH_STENCIL_ATTACHMENT),
            ],
            limits: vec![
                ("maxImageDimension2D", u64::from(width.max(height)).max(4096)),
                ("maxImageDimension3D", 256),
                ("maxStorageBufferRange", plan.largest_buffer()),
                ("maxPushConstantsSize", 128),
                ("maxBoundDescriptorSets", 3),
                // `classify` of levels has six; `shade` has four, with the materials'.
                ("maxPerStageDescriptorStorageBuffers", if plan.levels.top > 0 { 6 } else { 4 }),
                ("maxColorAttachments", 4),
                ("maxComputeWorkGroupInvocations", 64),
            ],
        }
    }

    /// Every requirement held against a device, met or not.
    ///
    /// # Safety
    /// The instance is alive and the physical device is its own.
    pub unsafe fn rows(&self, instance: &ash::Instance, physical_device: vk::PhysicalDevice) -> Vec<Row> {
        // SAFETY: as the caller promises.
        let properties = unsafe { instance.get_physical_device_properties(physical_device) };
        let version = |v| format!("{}.{}.{}", vk::api_version_major(v), vk::api_version_minor(v), vk::api_version_patch(v));
        let mut rows = vec![Row {
            name: "apiVersion".into(),
            needed: format!("at least {}", version(self.api_version)),
            found: version(properties.api_version),
            ok: properties.api_version >= self.api_version,
        }];
        // Querying 1.3 features of an older device is not allowed.
        let mut f13 = vk::PhysicalDeviceVulkan13Features::default();
        if properties.api_version >= vk::API_VERSION_1_3 {
            let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut f13);
            // SAFETY: as above; the chain holds core structs only.
            unsafe { instance.get_physical_device_features2(physical_device, &mut features) };
        }
        for (name, have) in [("dynamicRendering", f13.dynamic_rendering), ("synchronization2", f13.synchronization2)] {
            rows.push(Row {
                name: name.into(),
                needed: "true".into(),
                found: (have == vk::TRUE).to_string(),
                ok: have == vk::TRUE,
            });
        }
        // SAFETY: as above.
        let families = unsafe { instance.get_physical_device_queue_family_properties(physical_device) };
        let family = families.iter().position(|f| f.queue_flags.contains(self.queue));
        rows.push(Row {
            name: "queue family".into(),
            needed: format!("{:?}", self.queue),
            found: family.map_or("none".into(), |i| format!("family {i}")),
            ok: family.is_some(),
        });
        for &(format, needed) in &self.formats {
            // SAFETY: as above.
            let found =
                unsafe { instance.get_physical_device_format_properties(physical_device, format) }.optimal_tiling_features;
            rows.push(Row {
                name: format!("{format:?}"),
                needed: format!("{needed:?}"),
                found: if found.contains(needed) { "all of it".into() } else { format!("without {:?}", needed & !found) },
                ok: found.contains(needed),
            });
        }
        for &(name, needed) in &self.limits {
            let found = limit(&properties.limits, name);
            let needed_text = format!("at least {needed}");
            rows.push(Row { name: name.into(), needed: needed_text, found: found.to_string(), ok: found >= needed });
        }
        rows
    }

    /// Whether a device meets all requirements.
    ///
    /// # Errors
    /// [`Missing`] lists every gap, not only the first.
    ///
    /// # Safety
    /// As [`Self::rows`].
    pub unsafe fn check(&self, instance: &ash::Instance, physical_device: vk::PhysicalDevice) -> Result<(), Missing> {
        // SAFETY: as the caller promises.
        let gaps: Vec<_> = unsafe { self.rows(instance, physical_device) }.into_iter().filter(|r| !r.ok).collect();
        if gaps.is_empty() { Ok(()) } else { Err(Missing(gaps)) }
    }

    /// Switches the needed features on in the structs from which the host creates its device; others stay as they are.
    pub fn merge_into(&self, features: &mut vk::PhysicalDeviceVulkan13Features<'_>) {
        features.dynamic_rendering = vk::TRUE;
        features.synchronization2 = vk::TRUE;
    }
}

fn limit(limits: &vk::PhysicalDeviceLimits, name: &str) -> u64 {
    match name {
        "maxImageDimension2D" => limits.max_image_dimension2_d.into(),
        "maxImageDimension3D" => limits.max_image_dimension3_d.into(),
        "maxStorageBufferRange" => limits.max_storage_buffer_range.into(),
        "maxPushConstantsSize" => limits.max_push_constants_size.into(),
        "maxBoundDescriptorSets" => limits.max_bound_descriptor_sets.into(),
        "maxPerStageDescriptorStorageBuffers" => limits.max_per_stage_descriptor_storage_buffers.into(),
        "maxColorAttachments" => limits.max_color_attachments.into(),
        "maxComputeWorkGroupInvocations" => limits.max_compute_work_group_invocations.into(),
        _ => 0,
    }
}
