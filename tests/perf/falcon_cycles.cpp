// Exchanges many frames in both directions between the Falcon's driver and an emulated device, with faults on the way.
// Prints one JSON object. Everything is emulated: rates show what this machine's emulation can do, not a device.
#include <nlohmann/json.hpp>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>

#include "haptic_client/device/falcon.hpp"
#include "haptic_client/device/falcon_kinematics.hpp"
#include "tests/support/usb/usb_stage.hpp"

namespace {

using namespace osteon;
using namespace osteon::haptic;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr double kReach_m = 0.02;  // radius of the grip's circle

struct Counted {
  std::uint64_t reads = 0, usable = 0, unplugged = 0, wrong_places = 0;
  std::uint64_t force_after_loss = 0;
};

// Waits until the condition has been true. The emulation is slow, but never stuck.
template <class Condition>
bool until(const Condition& condition) {
  const auto deadline = Clock::now() + 60s;
  while (!condition()) {
    if (Clock::now() > deadline) return false;
    std::this_thread::sleep_for(1ms);
  }
  return true;
}

std::string encoders_of(const Eigen::Vector3d& grip_m) {
  const Eigen::Vector3d angles = *falcon_angles(grip_m);
  std::string line = "falcon encoders";
  for (int i = 0; i < 3; ++i) line += " " + std::to_string(std::lround(falcon_counts(angles[i])));
  return line;
}

int fail(const std::string& what) {
  std::fprintf(stderr, "osteon-falcon-cycles: %s\n", what.c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  test::enter_usb_emulation(argv);
  const std::uint64_t cycles = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 100000;
  const int unplugs = argc > 2 ? std::atoi(argv[2]) : 10;

  test::UsbStage usb;
  const auto falcon = make_falcon({.firmware = {}, .priority = 0});
  Counted counted;
  std::uint64_t frames = 0, bad = 0, with_force = 0, samples = 0;
  double seconds = 0.0;
  double angle = 0.0;
  const auto go_round = [&] {
    angle += 0.1;
    usb.command(encoders_of({kReach_m * std::cos(angle), kReach_m * std::sin(angle), kFalconOriginZ_m}));
  };
  for (int round = 0; round <= unplugs; ++round) {
    usb.command("plug falcon loaded");
    go_round();
    if (const Result<void> opened = falcon->open(); !opened) return fail(opened.error().message);
    if (!until([&] { return falcon->read().usable(); })) return fail("it does not become ready");
    if (usb.falcon_told().with_force > 0) ++counted.force_after_loss;
    const auto begun = Clock::now();
    const std::uint64_t first = falcon->read().sample, wanted = cycles / static_cast<std::uint64_t>(unplugs + 1) + 1;
    // The haptic thread reads and writes a thousand times a second, while the grip moves in a circle.
    std::uint64_t last = first;
    while (last < first + wanted) {
      if (counted.reads % 200 == 0) go_round();
      const DeviceReading reading = falcon->read();
      ++counted.reads;
      if (reading.usable()) ++counted.usable;
      const double radius =
          std::hypot(reading.pose_device_tool.position_mm.x(), reading.pose_device_tool.position_mm.y());
      if (std::abs(radius - 1e3 * kReach_m) > 0.2) ++counted.wrong_places;
      falcon->write(Vec3(0.0, 0.0, 2.0));
      last = reading.sample;
      if (const Result<void> well = falcon->tend(); !well) return fail(well.error().message);
      std::this_thread::sleep_for(1ms);
    }
    seconds += std::chrono::duration<double>(Clock::now() - begun).count();
    samples += last - first;
    const auto told = usb.falcon_told();
    frames += told.frames;
    bad += told.bad_frames;
    with_force += told.with_force;
    if (round == unplugs) break;
    usb.command("unplug falcon");
    if (!until([&] { return !falcon->tend(); })) return fail("its loss goes unnoticed");
    if (!falcon->read().usable()) ++counted.unplugged;
    falcon->close();
  }
  falcon->close();
  const nlohmann::json out{{"samples", samples},
                           {"frames", frames},
                           {"bad_frames", bad},
                           {"frames_with_force", with_force},
                           {"seconds", seconds},
                           {"cycles_per_s", static_cast<double>(samples) / seconds},
                           {"reads", counted.reads},
                           {"unusable_reads", counted.reads - counted.usable},
                           {"wrong_places", counted.wrong_places},
                           {"unplugs", unplugs},
                           {"unplugs_noticed", counted.unplugged},
                           {"force_after_loss", counted.force_after_loss}};
  std::printf("%s\n", out.dump(2).c_str());
}
