// A simulated arm behind our stand-ins for vendors' libraries, and the strings by which a test pulls it: a file that
// both map, so that the library may be in the test's own process or in another's. Device frame as HDAPI's: x right, y
// up, z to the user; millimetres, newtons. Time is counted in cycles of 1 ms, whatever they really take.
#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string>

namespace osteon::test {

inline constexpr const char* kArmVariable = "OSTEON_TEST_ARM";  // environment: the file

struct ArmControl {
  // What the test says.
  std::atomic<int> plugged{1};
  std::atomic<int> fast{0};     // cycles follow each other without sleep
  std::atomic<int> stalled{0};  // no cycles at all, as when the vendor's thread hangs
  // No cycle begins once so many are done: time stands still. (Of libdhd's stand-in.)
  std::atomic<std::uint64_t> until{~std::uint64_t{0}};
  std::atomic<int> next_error{0};    // raised once by the next cycle
  std::atomic<int> error_cycles{0};  // for so many cycles `lasting_error` is raised
  std::atomic<int> lasting_error{0};
  std::atomic<int> open_error{0};   // opening fails with it
  std::atomic<int> calibration{0};  // 0 done, 1 can be done by the program, 2 needs the user
  std::atomic<int> style{2};        // HDAPI's bits
  std::atomic<int> output_axes{3};
  std::atomic<int> silent_limits{0};  // the device tells none
  std::atomic<int> type{33};          // libdhd's
  std::atomic<int> buttons{0};
  std::atomic<double> temperature{0.2};
  std::array<std::atomic<double>, 3> hand_mm{};   // where the hand wants the handle
  std::atomic<double> hand_n_per_mm{0.5};         // how stiffly; the hand is damped critically
  std::array<std::atomic<double>, 4> rotation{};  // of the handle in the vendor's frame: w, x, y, z

  // What happened.
  std::atomic<std::uint64_t> cycles{0}, opened{0}, closed{0}, scheduler_starts{0}, scheduler_stops{0},
      emergency_stops{0};
  std::atomic<std::uint64_t> misuse{0};         // calls that the vendor's library forbids
  std::atomic<std::uint64_t> unsafe_forces{0};  // a force while not calibrated, or with motors not enabled
  std::atomic<int> motors_on{0}, is_open{0};
  std::array<std::atomic<double>, 3> arm_mm{}, force_n{}, torque_nmm{};
  std::atomic<double> peak_n{0};  // largest since the test set it to 0
};

// Makes the file and maps it, for a test; sets the environment variable for libraries of this process. A library keeps
// to the first file that it was given, so a process has one of these.
class ArmStrings {
 public:
  explicit ArmStrings(const std::filesystem::path& file);
  ~ArmStrings();
  ArmStrings(const ArmStrings&) = delete;
  ArmStrings& operator=(const ArmStrings&) = delete;
  ArmControl* operator->() const noexcept { return control_; }
  ArmControl& operator*() const noexcept { return *control_; }
  void hand(double x_mm, double y_mm, double z_mm) const noexcept;
  [[nodiscard]] double force_n() const noexcept;  // size
  void reset() const noexcept;                    // as it was at first, with nothing counted

 private:
  ArmControl* control_;
};

// In a stand-in library: the strings that the environment names. Null: none, and nothing is plugged in.
[[nodiscard]] ArmControl* find_arm() noexcept;

// The handle: a mass in a hand that is a spring and a damper, pushed by the motors.
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
