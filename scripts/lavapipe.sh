# Sourced by the other scripts: finds and selects lavapipe, Mesa's Vulkan driver in software.

# Prints the driver's manifest; fails if it is not installed.
lavapipe_manifest() {
    local folder file
    for folder in /usr/share/vulkan/icd.d /usr/local/share/vulkan/icd.d /etc/vulkan/icd.d; do
        for file in "$folder"/lvp_icd*.json; do
            if [ -f "$file" ]; then
                echo "$file"
                return 0
            fi
        done
    done
    return 1
}

# Makes the Vulkan loader see lavapipe alone. Both names are set: old loaders know only the first, new ones prefer the second.
select_lavapipe() {
    local manifest
    manifest=$(lavapipe_manifest) || return 1
    export VK_ICD_FILENAMES="$manifest" VK_DRIVER_FILES="$manifest"
}
