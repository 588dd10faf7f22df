// The report of an import: a folder with report.html for people, report.json for programs, and pictures.
#pragma once
#include <filesystem>

#include "server/import/report_facts.hpp"

namespace osteon::import {

// Makes the folder, which must not exist:
//   report.html    everything in one file, with its pictures
//   report.json    the same facts, without pictures
//   montage.png    planes with outlines, and surfaces, of the case
//   islands.png    all islands, those left out are grey; only of bones that a threshold found
//   histogram.png  of the HU; only of a scan with HU
// No file says who the patient is, nor any date or path. If anything fails, what was written is removed.
// Errors: exists, internal (disk), exhausted (memory), cancelled.
[[nodiscard]] Result<void> write_report(const ImportReport& report, const std::filesystem::path& folder,
                                        const KeepGoing& keep_going);

}  // namespace osteon::import
