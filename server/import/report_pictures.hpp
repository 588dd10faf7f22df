// The pictures in the report of an import.
#pragma once
#include "server/import/label_views.hpp"
#include "server/import/report_facts.hpp"

namespace osteon::import {

// The case's labels in one picture: an axial, a coronal and a sagittal plane of the scan with their outlines, each
// where it meets most bone; their surface from the front and from the left; and a list of them. Error: cancelled.
[[nodiscard]] Result<Picture> montage(const LabelledVoxels& voxels, const std::vector<CaseLabel>& labels,
                                      const ReportFacts& facts, const KeepGoing& keep_going);

// One label by itself, from the front. Error: cancelled.
[[nodiscard]] Result<Picture> label_picture(const LabelledVoxels& voxels, int label, Colour colour,
                                            const KeepGoing& keep_going);

// How many voxels have each HU, for the scan and for its bone, with the threshold as a line. Counts are logarithmic.
[[nodiscard]] Picture histogram_picture(const ReportFacts& facts);

}  // namespace osteon::import
