// Initialises the OpenVDB library.
#pragma once

namespace osteon {

// Call it before OpenVDB reads or writes. Any thread, any number of times. Afterwards OpenVDB does not read a file's
// table for delayed loading. That table may declare any number of leaves, and OpenVDB allocates memory for all of
// them.
void start_openvdb();

}  // namespace osteon
