#include "haptic_client/app/pointer_feed.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "common/runtime/log.hpp"

namespace osteon::haptic {
namespace {

using namespace std::chrono_literals;

constexpr int kReport_ms = 16;
constexpr auto kAgain = 200ms;
constexpr std::string_view kName = "pointer";

}  // namespace

Result<std::unique_ptr<PointerFeed>> PointerFeed::start(const std::filesystem::path& socket, DeviceNotice notice) {
  Result<std::unique_ptr<PointerClient>> client = PointerClient::connect(socket);
  if (!client) return failure(client.error().code, "--device pointer: " + client.error().message);
  return std::unique_ptr<PointerFeed>(new PointerFeed(socket, std::move(*client), std::move(notice)));
}

PointerFeed::PointerFeed(std::filesystem::path socket, std::unique_ptr<PointerClient> client, DeviceNotice notice)
    : socket_(std::move(socket)), client_(std::move(client)), notice_(std::move(notice)) {
  thread_ = std::thread([this] { run(); });
}

PointerFeed::~PointerFeed() {
  stop_ = true;
  thread_.join();
}

void PointerFeed::set_tools(std::vector<Tool> tools) {
  tools_ = std::move(tools);
  ready_.store(true, std::memory_order_release);
}

std::vector<std::string_view> PointerFeed::pushed() const {
  std::vector<std::string_view> names;
  for (std::size_t i = 0; i < kPointerSources.size(); ++i)
    if (pushed_ & (1U << i)) names.push_back(kPointerSources[i]);
  return names;
}

void PointerFeed::run() {
  while (!stop_) {
    if (client_->closed()) {
      if (Result<std::unique_ptr<PointerClient>> again = PointerClient::connect(socket_)) {
        client_ = std::move(*again);
        notice_(DeviceEvent::back, kName, "");
      } else {
        std::this_thread::sleep_for(kAgain);
        continue;
      }
    }
    if (const std::optional<PointerInput> input = client_->wait(kReport_ms)) command(*input);
    if (ready_.load(std::memory_order_acquire)) report();
    if (client_->closed()) {
      ++losses_;
      notice_(DeviceEvent::lost, kName, "the window has gone");
    }
  }
}

void PointerFeed::choose(const PointerInput& input) {
  trouble_.clear();
  int tool = tool_;
  if (!input.tool.empty()) {
    const auto found = std::ranges::find(tools_, input.tool, &Tool::name);
    if (found == tools_.end()) {
      trouble_ = "the tool \"" + input.tool + "\" cannot be held; choose one that cuts";
      return;
    }
    tool = static_cast<int>(found - tools_.begin());
  }
  const ForceLaw* law = nullptr;
  if (!input.law.empty()) {
    const Result<const ForceLaw*> fits = choose_law(tools_[static_cast<std::size_t>(tool)], input.law);
    if (!fits) {
      trouble_ = fits.error().message;
      return;
    }
    law = *fits;
  }
  if (tool != tool_) exchange_.wanted.want(tool);
  tool_ = tool;
  law_ = law;
}

void PointerFeed::command(const PointerInput& input) {
  if (!ready_.load(std::memory_order_acquire)) return;
  choose(input);
  if (input.push && pushes_ != input.source) {
    pushes_ = input.source;
    pushed_ |= 1U << static_cast<unsigned>(input.source);
    log::info("pointer", {{"source", name_of(input.source)}});
  }
  PointerCommand& command = exchange_.commands.writable();
  command = {.number = ++number_,
             .target_mm = input.target_mm,
             .rotation = input.rotation_bone_tool,
             .on_bone = input.on_bone && trouble_.empty() && !input.empty_hand,
             .push = input.push,
             .fine = input.fine,
             .push_n = input.push_n,
             .spindle = input.spindle,
             .spindle_rpm = input.spindle_rpm,
             .tool = tool_,
             .irrigation = input.irrigation,
             .suction = input.suction,
             .empty_hand = input.empty_hand,
             .source = input.source,
             // A wear is of the tool that the message names.
             .wear = trouble_.empty() ? input.wear.value_or(0.0) : 0.0,
             .law = law_};
  exchange_.commands.publish();
}

void PointerFeed::report() {
  if (!exchange_.states.refresh() && trouble_.empty()) return;
  const PointerState& state = exchange_.states.value();
  client_->send({.pose_bone_tool = state.pose_bone_tool,
                 .force_hand_n = state.force_hand_n,
                 .force_bone_n = state.force_bone_n,
                 .device_holds_n = state.device_holds_n,
                 .push_n = state.push_n,
                 .depth_mm = state.depth_mm,
                 .pushing = state.pushing,
                 .on_metal = state.on_metal,
                 .saturated = state.saturated,
                 .tool = tools_[static_cast<std::size_t>(state.tool)].name,
                 .wear = state.wear,
                 .law = state.law ? std::string(state.law->name) : std::string(),
                 .trouble = trouble_});
}

}  // namespace osteon::haptic
