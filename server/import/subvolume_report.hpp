// The report of `osteon-import report`: tables as text and as JSON, and a picture of the boxes on the bone.
#pragma once
#include <filesystem>
#include <string>

#include "server/import/picture.hpp"
#include "server/import/subvolume_measures.hpp"

namespace osteon::import {

// Tables 5.1 to 5.3 of Niu 2008, the active sub-volumes of each step, and OpenVDB's tree beside them.
[[nodiscard]] std::string to_text(const SubVolumeMeasures& measures);
[[nodiscard]] std::string to_json(const SubVolumeMeasures& measures);

// The bone from the front and from the left with the object box and the sections, and the highest section from below
// with its quadrants. Error: cancelled.
[[nodiscard]] Result<Picture> boxes_picture(const SubVolumeInput& input, const SubVolumeMeasures& measures,
                                            const KeepGoing& keep_going);

// Makes a folder with report.txt, report.json, boxes.png, and the Meta file and SBB files of the sections. Reads these
// files again, and compares them with the scan. Errors: exists, internal (disk; what was read differs), cancelled.
[[nodiscard]] Result<void> write_sub_volumes(const SubVolumeInput& input, const SubVolumeMeasures& measures,
                                             const std::filesystem::path& folder, const KeepGoing& keep_going);

}  // namespace osteon::import
