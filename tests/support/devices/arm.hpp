// A simulated arm behind our stand-ins for vendors' libraries, and the controls by which a test drives it. Both map one
// file, so the library may be in the test's process or in another one. Device frame as HDAPI's: x right, y up, z to the
// user; millimetres, newtons. Time is counted in cycles of 1 ms, whatever their real duration.
#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string>

namespace osteon::test {

inline constexpr const char* kArmVariable = "OSTEON_TEST_ARM";  // environment variable: the file

struct ArmControl {
  // Set by the test.
  std::atomic<int> plugged{1};
  std::atomic<int> fast{0};     // no sleep between cycles
  std::atomic<int> stalled{0};  // no cycles at all, as when the vendor's thread hangs
  // No further cycle begins after this number of cycles: time stands still. (Only libdhd's stand-in.)
  std::atomic<std::uint64_t> until{~std::uint64_t{0}};
  std::atomic<int> next_error{0};    // raised once by the next cycle
  std::atomic<int> error_cycles{0};  // `lasting_error` is raised for this number of cycles
  std::atomic<int> lasting_error{0};
  std::atomic<int> open_error{0};   // opening fails with it
  std::atomic<int> calibration{0};  // 0 done, 1 can be done by the program, 2 needs the user
  std::atomic<int> style{2};        // HDAPI's bits
  std::atomic<int> output_axes{3};
  std::atomic<int> silent_limits{0};  // the device reports no limits
  std::atomic<int> type{33};          // libdhd's
  std::atomic<int> buttons{0};
  std::atomic<double> temperature{0.2};
  std::array<std::atomic<double>, 3> hand_mm{};   // target position of the handle
  std::atomic<double> hand_n_per_mm{0.5};         // the hand's stiffness; it is damped critically
  std::array<std::atomic<double>, 4> rotation{};  // of the handle in the vendor's frame: w, x, y, z

  // Counted by the library.
  std::atomic<std::uint64_t> cycles{0}, opened{0}, closed{0}, scheduler_starts{0}, scheduler_stops{0},
      emergency_stops{0};
  std::atomic<std::uint64_t> misuse{0};         // calls that the vendor's library forbids
  std::atomic<std::uint64_t> unsafe_forces{0};  // a force while not calibrated, or with motors not enabled
  std::atomic<int> motors_on{0}, is_open{0};
  std::array<std::atomic<double>, 3> arm_mm{}, force_n{}, torque_nmm{};
  std::atomic<double> peak_n{0};  // largest since the test set it to 0
};

// Makes the file and maps it, for a test. Sets the environment variable for libraries of this process. A library keeps
// the first file that it was given, so a process has only one of these.
class ArmStrings {
 public:
  explicit ArmStrings(const std::filesystem::path& file);
  ~ArmStrings();
  ArmStrings(const ArmStrings&) = delete;
  ArmStrings& operator=(const ArmStrings&) = delete;
  ArmControl* operator->() const noexcept { return control_; }
  ArmControl& operator*() const noexcept { return *control_; }
  void hand(double x_mm, double y_mm, double z_mm) const noexcept;
  [[nodiscard]] double force_n() const noexcept;  // magnitude
  void reset() const noexcept;                    // back to the start values, all counters zero

 private:
  ArmControl* control_;
};

// For a stand-in library: the controls that the environment names. Null: there are none, and no device is plugged in.
[[nodiscard]] ArmControl* find_arm() noexcept;

// The handle: a mass held by a hand (spring and damper) and pushed by the motors.
class Arm {
 public:
  // One millisecond with the motors' force, which the device clamps to its peak.
  void step(ArmControl& control, const std::array<double, 3>& force_n,
            const std::array<double, 3>& torque_nmm) noexcept;
  [[nodiscard]] const std::array<double, 3>& position_mm() const noexcept { return position_mm_; }

  static constexpr double kPeak_n = 3.3, kContinuous_n = 0.88, kStiffness_n_per_mm = 1.0;
  static constexpr double kMass_kg = 0.2;

 private:
  std::array<double, 3> position_mm_{}, velocity_mm_per_s_{};
};

}  // namespace osteon::test
