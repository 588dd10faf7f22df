// Names in a recording, which haptic_client/app writes, and the recorded device, the sound and h5py read.
//
// The groups are those of the recordings of FIVRS, the volumetric drilling simulator on AMBF. Source:
// github.com/LCSR-SICKKIDS/volumetric_drilling, its recording script and the description of its format. The groups are
// `metadata`, `data`, `high_frequency_poses`, `drill_force_feedback`, `burr_change`. Each sample has its `time_stamp`.
// Poses are [x, y, z, qx, qy, qz, qw], wrenches are [fx, fy, fz, tx, ty, tz]. Unlike there, lengths are millimetres.
// Every array names its unit and its frame. The room's journal contains the removed bone, so there is no
// `voxels_removed`.
#pragma once

namespace osteon::recording {

// Attributes of the file.
inline constexpr const char* kFormatName = "format";
inline constexpr const char* kFormat = "osteon recording";
inline constexpr const char* kVersionName = "version";
inline constexpr int kVersion = 1;

// One row for each millisecond.
inline constexpr const char* kTime = "data/time";  // written last: rows beyond its end are not complete
inline constexpr const char* kTick = "data/state_seq";
inline constexpr const char* kHandlePose = "high_frequency_poses/handle_pose/pose";
// Of a bone on its mount; older recordings have none.
inline constexpr const char* kBonePose = "high_frequency_poses/bone_pose/pose";
// What the tool does: see the readme in the file for frames.
inline constexpr const char* kToolPose = "high_frequency_poses/drill_pose/pose";
inline constexpr const char* kWrench = "drill_force_physical/wrench";
inline constexpr const char* kMonoNs = "data/mono_ns";
inline constexpr const char* kSpindleRpm = "data/spindle_rpm";
inline constexpr const char* kFeed = "data/feed";
inline constexpr const char* kDensity = "data/density";
inline constexpr const char* kEngaged = "data/engaged";
inline constexpr const char* kTorque = "data/torque";
inline constexpr const char* kState = "data/state";
inline constexpr const char* kTool = "data/tool";
// Recordings of older versions lack these.
inline constexpr const char* kCortex = "data/cortex";
inline constexpr const char* kSeated = "data/seated";
inline constexpr const char* kBlows = "data/blows";
inline constexpr const char* kBlowImpulse = "data/blow_impulse";
inline constexpr const char* kButtons = "data/buttons";
inline constexpr const char* kPedal = "data/pedal";
inline constexpr const char* kDeviceStatus = "data/device_status";
inline constexpr const char* kCalibration = "data/calibration";
inline constexpr const char* kCommandedRpm = "data/commanded_rpm";
inline constexpr const char* kPhase = "data/phase";
inline constexpr const char* kLaw = "data/law";
inline constexpr const char* kWear = "data/wear";
// What leads a pointer's hand: 0 no pointer, then the PointerSources. In older recordings it is missing, and so is the
// bit of data/buttons that says when the hand cuts.
inline constexpr const char* kPointerSource = "data/pointer_source";

// A row for each time that a tool was taken up.
inline constexpr const char* kTakeUpRow = "burr_change/row";
inline constexpr const char* kTakeUpTool = "burr_change/tool";
inline constexpr const char* kTakeUpPose = "burr_change/pose";
inline constexpr const char* kTakeUpView = "burr_change/view";
inline constexpr const char* kTakeUpScale = "burr_change/scale";
inline constexpr const char* kTakeUpDevice = "burr_change/anchor_device";
inline constexpr const char* kTakeUpBone = "burr_change/anchor_bone";

// Attributes of the group `metadata`: the device's DeviceLimits and DeviceInfo.
inline constexpr const char* kMetadata = "metadata";
inline constexpr const char* kAuthor = "author";  // in the room
inline constexpr const char* kDevice = "device";
inline constexpr const char* kPointer = "pointer";  // the device of a hand that a mouse, pen or game pad leads
inline constexpr const char* kModel = "device_model";
inline constexpr const char* kCaseHash = "case_hash";
inline constexpr const char* kCaseTitle = "case_title";
inline constexpr const char* kPlanDigest = "plan_digest";    // older recordings have none
inline constexpr const char* kForceScale = "force_scale";    // of small forces
inline constexpr const char* kForceChoice = "force_choice";  // older recordings have none: proportional
inline constexpr const char* kPeak = "device_peak_n";
inline constexpr const char* kContinuous = "device_continuous_n";
inline constexpr const char* kStiffness = "device_stiffness_n_per_mm";
inline constexpr const char* kWorkspace = "device_workspace_radius_mm";
inline constexpr const char* kDamping = "device_damping_n_s_per_mm";
inline constexpr const char* kPeakTorque = "device_peak_nmm";
inline constexpr const char* kContinuousTorque = "device_continuous_nmm";
inline constexpr const char* kMiddleX = "device_workspace_middle_x_mm";
inline constexpr const char* kMiddleY = "device_workspace_middle_y_mm";
inline constexpr const char* kMiddleZ = "device_workspace_middle_z_mm";
inline constexpr const char* kForceAxes = "device_force_axes";
inline constexpr const char* kTorqueAxes = "device_torque_axes";
// Names of the session's tools, by their index in it.
inline constexpr const char* kTools = "metadata/tools";
inline constexpr const char* kLaws = "metadata/laws";
// Set when the room was joined; older recordings have none.
inline constexpr const char* kStartHash = "metadata/field_hash_at_start";
// Set at the end.
inline constexpr const char* kFieldHash = "metadata/field_hash";

}  // namespace osteon::recording
