// Tests what holds for any device: the exchange between its I/O and the haptic thread, its connection, and several
// devices as one.
#include "haptic_client/device/haptic_device.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <thread>

#include "haptic_client/device/combined_device.hpp"
#include "haptic_client/device/device_exchange.hpp"
#include "haptic_client/device/device_list.hpp"
#include "haptic_client/device/dynamic_library.hpp"
#include "haptic_client/device/emergency_stop.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/unit/haptic_client/device/devices.hpp"

namespace osteon::haptic::test {
namespace {

using Time = DeviceExchange::Time;

TEST(DeviceExchange, IsAbsentUntilSomethingWasRead) {
  DeviceExchange exchange;
  EXPECT_EQ(exchange.read().status, DeviceStatus::absent);
  EXPECT_FALSE(exchange.read().usable());
  EXPECT_EQ(exchange.demanded(Time{}).force_n, Vec3::Zero().eval());
}

TEST(DeviceExchange, AForceLastsAsLongAsItIsWritten) {
  DeviceExchange exchange;
  const Time start{std::chrono::hours(1)};
  exchange.write({Vec3(1, 2, 3)}, start);
  EXPECT_EQ(exchange.demanded(start).force_n, Vec3(1, 2, 3));
  EXPECT_EQ(exchange.demanded(start + 2999us).force_n, Vec3(1, 2, 3));
  EXPECT_EQ(exchange.demanded(start + 3ms).force_n, Vec3(0, 0, 0));
  EXPECT_EQ(exchange.demanded(start + 1h).force_n, Vec3(0, 0, 0));
  exchange.write({Vec3(4, 0, 0)}, start + 10ms);
  EXPECT_EQ(exchange.demanded(start + 11ms).force_n, Vec3(4, 0, 0));
  // The age of a force counts from its writing, even if the device's thread reads it late.
  exchange.write({Vec3(6, 0, 0)}, start + 20ms);
  EXPECT_EQ(exchange.demanded(start + 23ms).force_n, Vec3(0, 0, 0));
  // A force written before a device was opened again is not shown.
  exchange.write({Vec3(5, 0, 0)}, start + 30ms);
  exchange.forget_output();
  EXPECT_EQ(exchange.demanded(start + 30ms).force_n, Vec3(0, 0, 0));
}

// Haptic thread and device run at 1 kHz, with any phase between their ticks. The last force lasts through two missed
// ticks and ends with the third. A tick that is late by less than three periods interrupts nothing.
TEST(DeviceExchange, TheForceIsZeroAfterThreeMissedTicks) {
  constexpr int kLastTick = 20;
  for (const auto phase : {1us, 250us, 500us, 750us, 999us}) {
    for (const int pause : {1, 2, 3}) {
      DeviceExchange exchange;
      const Time start{std::chrono::hours(1)};
      for (int ms = 0; ms <= kLastTick + 6; ++ms) {
        if (ms <= kLastTick && (kLastTick - ms) % pause == 0) exchange.write({Vec3(0, 0, 2)}, start + ms * 1ms);
        const bool begun = ms >= kLastTick % pause;
        const int missed = std::max(0, ms - kLastTick);
        const Vec3 shown = exchange.demanded(start + ms * 1ms + phase).force_n;
        EXPECT_EQ(shown.z(), begun && missed < 3 ? 2.0 : 0.0) << "phase " << phase.count() << " us, tick " << ms;
      }
    }
  }
}

TEST(DeviceExchange, ASilentDeviceIsNotTrusted) {
  DeviceExchange exchange;
  DeviceReading reading;
  reading.buttons = kSpindlePedal;
  reading.pedal = 0.5;
  exchange.publish(reading);
  for (int i = 0; i < DeviceExchange::kReadsWithoutSample; ++i)
    EXPECT_EQ(exchange.read().status, DeviceStatus::ok) << i;
  const DeviceReading late = exchange.read();
  EXPECT_EQ(late.status, DeviceStatus::fault);
  EXPECT_EQ(late.spindle(), 0.0);
  exchange.publish(reading);
  EXPECT_EQ(exchange.read().spindle(), 1.0);
  exchange.go_absent();
  EXPECT_EQ(exchange.read().status, DeviceStatus::absent);
}

TEST(DeviceExchange, CrossesThreadsWholeAndWithoutAllocation) {
  DeviceExchange exchange;
  std::atomic<bool> over{false};
  std::atomic<std::int64_t> allocations{0};
  std::thread device([&] {
    const osteon::test::AllocationCounter heap;
    for (double i = 1; !over; ++i) {
      DeviceReading reading;
      reading.pose_device_tool.position_mm = Vec3::Constant(i);
      reading.pedal = i;
      exchange.publish(reading);
      const DeviceOutput output = exchange.demanded(Time{});
      EXPECT_EQ(output.force_n.x(), output.torque_nmm.z());
    }
    allocations = heap.count();
  });
  const osteon::test::AllocationCounter heap;
  int mixed = 0;
  double last = 0.0;
  for (int i = 0; i < 200000; ++i) {
    const DeviceReading reading = exchange.read();
    mixed += reading.status == DeviceStatus::ok && reading.pose_device_tool.position_mm.z() != reading.pedal;
    mixed += reading.pose_device_tool.position_mm.x() < last;
    last = reading.pose_device_tool.position_mm.x();
    exchange.write({Vec3::Constant(i), Vec3::Constant(i)});
  }
  over = true;
  const std::int64_t own = heap.count();
  device.join();
  EXPECT_EQ(mixed, 0);
  EXPECT_EQ(own, 0);
  EXPECT_EQ(allocations, 0);
}

// A device that the test controls completely.
class Puppet final : public HapticDevice {
 public:
  Puppet(std::string name, const DeviceInfo& info) : name_(std::move(name)), info_(info) {}
  [[nodiscard]] std::string_view name() const override { return name_; }
  [[nodiscard]] DeviceLimits limits() const override { return limits_; }
  [[nodiscard]] DeviceInfo info() const override { return info_; }
  [[nodiscard]] DeviceReading read() noexcept override { return reading; }
  void write(const DeviceOutput& output) noexcept override { written = output; }
  [[nodiscard]] std::string advice() const override { return advice_is; }
  Result<void> open() override {
    ++opens;
    if (!there) return failure(ErrorCode::not_found, "it is not there; plug it in");
    is_open = true;
    return {};
  }
  void close() noexcept override { is_open = false; }
  Result<void> tend() override {
    if (!there) return failure(ErrorCode::unavailable, "it is gone; plug it in");
    return {};
  }

  DeviceReading reading;
  DeviceOutput written;
  std::string advice_is;
  std::atomic<bool> there{true}, is_open{false};
  std::atomic<int> opens{0};

 private:
  std::string name_;
  DeviceInfo info_;
  DeviceLimits limits_{.peak_n = 8, .continuous_n = 4, .stiffness_n_per_mm = 3, .workspace_radius_mm = 40};
};

TEST(DeviceConnection, TellsOnceWhatItWaitsForAndWhatCameBack) {
  Puppet device("puppet", {});
  Heard heard;
  DeviceConnection connection(device, heard.notice(), {2ms, 2ms});
  device.there = false;
  ASSERT_FALSE(connection.start());
  EXPECT_FALSE(device.is_open);
  device.there = true;
  device.advice_is = "wave";
  ASSERT_TRUE(connection.start());
  EXPECT_EQ(heard.last(DeviceEvent::advice), "wave");
  device.there = false;
  const int before = device.opens;
  ASSERT_TRUE(wait_until([&] { return device.opens > before + 5; }, kPatience));
  EXPECT_FALSE(device.is_open);
  EXPECT_EQ(heard.count(DeviceEvent::lost), 1u);
  EXPECT_EQ(heard.last(DeviceEvent::advice), "it is not there; plug it in");
  EXPECT_EQ(heard.count(DeviceEvent::advice), 2u);  // not at every attempt
  device.there = true;
  ASSERT_TRUE(wait_until([&] { return heard.count(DeviceEvent::back) == 1; }, kPatience));
  connection.stop();
  EXPECT_FALSE(device.is_open);
}

struct Parts {
  Puppet* hand = nullptr;
  Puppet* turn = nullptr;
  Puppet* foot = nullptr;
  std::unique_ptr<CombinedDevice> all;
};
Parts put_together() {
  Parts parts;
  auto hand = std::make_unique<Puppet>("hand", DeviceInfo{.model = "H", .serial = {}, .driver = {}, .turns = false});
  auto turn = std::make_unique<Puppet>("turn", DeviceInfo{.model = "T", .serial = {}, .driver = {}, .force_axes = 0});
  auto foot = std::make_unique<Puppet>(
      "foot",
      DeviceInfo{
          .model = "F", .serial = {}, .driver = {}, .places = false, .turns = false, .pedals = true, .force_axes = 0});
  parts.hand = hand.get();
  parts.turn = turn.get();
  parts.foot = foot.get();
  std::vector<std::unique_ptr<HapticDevice>> all;
  all.push_back(std::move(hand));
  all.push_back(std::move(turn));
  all.push_back(std::move(foot));
  parts.all = std::move(*CombinedDevice::make(std::move(all)));
  return parts;
}

TEST(CombinedDevice, TakesPlaceRotationAndSpindleFromThree) {
  const Parts parts = put_together();
  EXPECT_EQ(parts.all->name(), "hand+turn+foot");
  EXPECT_TRUE(parts.all->info().turns);
  EXPECT_TRUE(parts.all->info().pedals);
  EXPECT_EQ(parts.all->limits().peak_n, 8.0);
  parts.hand->reading.pose_device_tool.position_mm = {1, 2, 3};
  parts.turn->reading.pose_device_tool = {{7, 8, 9}, pointing_away()};
  parts.foot->reading.pedal = 0.4;
  const DeviceReading reading = parts.all->read();
  EXPECT_EQ(reading.pose_device_tool.position_mm, Vec3(1, 2, 3));
  EXPECT_EQ(reading.pose_device_tool.direction(Vec3::UnitZ()), Vec3(0, 0, -1));
  EXPECT_EQ(reading.spindle(), 0.4);
  EXPECT_TRUE(reading.usable());
  parts.all->write({Vec3(1, 0, 0), Vec3(0, 1, 0)});
  EXPECT_EQ(parts.hand->written.force_n, Vec3(1, 0, 0));
  EXPECT_EQ(parts.hand->written.torque_nmm, Vec3(0, 0, 0));
}

TEST(CombinedDevice, WithAPedalTheHandsSpindleButtonIsAClutch) {
  const Parts parts = put_together();
  parts.hand->reading.buttons = kSpindlePedal;
  EXPECT_EQ(parts.all->read().buttons, std::uint32_t{kClutchButton});
  parts.hand->reading.buttons = 0;
  parts.foot->reading.buttons = kSpindlePedal;
  EXPECT_EQ(parts.all->read().buttons, std::uint32_t{kSpindlePedal});
  parts.foot->reading.buttons = kIrrigation | kSuction;
  EXPECT_EQ(parts.all->read().buttons, std::uint32_t{kIrrigation | kSuction});
  parts.foot->reading.status = DeviceStatus::absent;
  EXPECT_EQ(parts.all->read().buttons, 0u);
}

TEST(CombinedDevice, NeitherHandNorRotationMayBeMissing) {
  for (const auto part : {&Parts::hand, &Parts::turn}) {
    const Parts parts = put_together();
    (parts.*part)->reading.status = DeviceStatus::absent;
    EXPECT_EQ(parts.all->read().status, DeviceStatus::absent);
    (parts.*part)->reading = {};
    (parts.*part)->reading.calibration = Calibration::pending;
    EXPECT_FALSE(parts.all->read().usable());
  }
  const Parts parts = put_together();
  parts.foot->reading.pedal = 1.0;
  parts.foot->reading.status = DeviceStatus::absent;
  EXPECT_TRUE(parts.all->read().usable());
  EXPECT_EQ(parts.all->read().spindle(), 0.0);
}

TEST(DeviceList, NamesArePutTogetherOrRefusedWithTheRemedy) {
  const auto made = make_devices("falcon+spacemouse+pedal", {});
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ((*made)->parts().size(), 3u);
  EXPECT_FALSE((*made)->read().usable());  // nothing was opened
  (*made)->write({});
  EXPECT_TRUE(make_devices("phantom:Left", {}));
  EXPECT_TRUE(make_devices("force-dimension:1+pedal-axis", {}));
  const auto message = [](std::string_view names) {
    const auto result = make_devices(names, {});
    return result ? std::string() : result.error().message;
  };
  EXPECT_NE(message("fantom").find("choose among"), std::string::npos);
  EXPECT_NE(message("").find("choose among"), std::string::npos);
  EXPECT_NE(message("phantom+").find("--device phantom+: a name is missing"), std::string::npos);
  EXPECT_NE(message("phantom+simulated").find("simulated has a simulated hand; name it alone"), std::string::npos);
  EXPECT_NE(message("spacemouse+spacemouse").find("spacemouse is named twice"), std::string::npos);
  EXPECT_NE(message("falcon+spacemouse+spacemouse").find("two devices for the rotation"), std::string::npos);
  for (const char* nothing : {"recorded", "recorded:"})
    EXPECT_NE(message(nothing).find("it needs a file; name it, recorded:FILE"), std::string::npos) << nothing;
  EXPECT_NE(message("falcon+recorded:/nowhere.h5").find("a recording is played alone"), std::string::npos);
  EXPECT_NE(message("recorded:/nowhere.h5+pedal").find("there is no file /nowhere.h5+pedal"), std::string::npos);
  EXPECT_NE(message("pedal").find("first device must be one for the hand"), std::string::npos);
  EXPECT_NE(message("phantom+falcon").find("cannot be added"), std::string::npos);
  EXPECT_NE(message("phantom+pedal+pedal-axis").find("two devices for the spindle"), std::string::npos);
  EXPECT_NE(message("falcon:1").find("leave out the colon"), std::string::npos);
  EXPECT_NE(message("force-dimension:x").find("0 to 15"), std::string::npos);
  EXPECT_TRUE(make_devices("falcon+pedal-axis:z:inverted", {}));
  EXPECT_TRUE(make_devices("falcon+spacemouse+pedal:left", {}));
  EXPECT_NE(message("falcon+pedal-axis:up").find("--device pedal-axis:up: what follows must be \"inverted\""),
            std::string::npos);
  EXPECT_NE(message("falcon+pedal:up").find("--device pedal:up: the pedal must be left, middle or right"),
            std::string::npos);
}

// The list names all that --device takes. For a file that the user named, it says whether it can be used.
TEST(DeviceList, ShowsEveryKindAndWhatIsWrongWithTheFilesOfTheUser) {
  const DeviceOptions wrong{
      .libhd = "/nowhere/libHD.so", .libdhd = "/nowhere/libdhd.so", .falcon_firmware = "/nowhere/falcon.bin"};
  std::vector<std::string_view> names;
  for (const DeviceLine& line : look_for_devices({})) {
    names.push_back(line.name);
    EXPECT_FALSE(line.finding.wrong_file) << line.name;
  }
  EXPECT_EQ(names,
            (std::vector<std::string_view>{"simulated", "simulated-3.3N", "pointer", "phantom", "force-dimension",
                                           "falcon", "spacemouse", "pedal", "pedal-axis", "recorded"}));
  for (const DeviceLine& line : look_for_devices(wrong)) {
    const bool has_file = line.name == "phantom" || line.name == "force-dimension" || line.name == "falcon";
    EXPECT_EQ(line.finding.wrong_file, has_file) << line.name;
    if (has_file) {
      EXPECT_NE(line.finding.missing.find("/nowhere/"), std::string::npos) << line.name;
    }
  }
}

TEST(DynamicLibrary, TellsMissingFromWrong) {
  constexpr const char* kNames[] = {"libosteon-nowhere.so.1", "libosteon-nowhere.so.2"};
  const auto missing = DynamicLibrary::load({"the vendor's thing", {}, kNames, "install it"});
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::not_found);
  EXPECT_EQ(
      missing.error().message,
      "the vendor's thing is not installed (looked for libosteon-nowhere.so.1, libosteon-nowhere.so.2); install it");
  constexpr const char* kSecond[] = {"libosteon-nowhere.so.1", "libm.so.6"};
  const auto found = DynamicLibrary::load({"the vendor's thing", {}, kSecond, "install it"});
  ASSERT_TRUE(found);
  double (*cosine)(double) = nullptr;
  ASSERT_TRUE(found->find("cos", cosine));
  EXPECT_EQ(cosine(0.0), 1.0);
  EXPECT_FALSE(found->find("no_such_function", cosine));
}

// The first handler that is registered at the exit runs last, when all motors have been stopped.
void start_motors_at_the_end() {
  int stops = 0;
  const EmergencyStop stop([](void* count) { ++*static_cast<int*>(count); }, &stops);
  stop.started();
  std::_Exit(EmergencyStop::process_ends() && stops == 1 ? 0 : 1);
}

TEST(EmergencyStop, StopsMotorsThatAreStartedWhileTheProcessEnds) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");  // a process in which nothing is registered yet
  const auto end = [] {
    std::atexit(start_motors_at_the_end);
    int stops = 0;
    const EmergencyStop stop([](void* count) { ++*static_cast<int*>(count); }, &stops);
    stop.started();
    std::exit(EmergencyStop::process_ends() || stops > 0 ? 2 : 0);
  };
  EXPECT_EXIT(end(), ::testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace osteon::haptic::test
