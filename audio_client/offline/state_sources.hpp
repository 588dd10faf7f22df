// The kinds of records that open_states() tells apart.
#pragma once
#include <filesystem>
#include <memory>

#include "audio_client/offline/state_record.hpp"
#include "common/core/result.hpp"

namespace osteon::audio {

[[nodiscard]] Result<std::unique_ptr<StateRecord>> open_recording(const std::filesystem::path& file);    // HDF5
[[nodiscard]] Result<std::unique_ptr<StateRecord>> open_session_log(const std::filesystem::path& file);  // CSV

}  // namespace osteon::audio
