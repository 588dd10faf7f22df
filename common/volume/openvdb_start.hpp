// The start of the OpenVDB library.
#pragma once

namespace osteon {

// Any thread, as often as you like: before OpenVDB reads or writes. OpenVDB then neither writes nor interprets its hint
// for delayed loading. That hint may declare any number of leaves, and OpenVDB allocates for all of them.
void start_openvdb();

}  // namespace osteon
