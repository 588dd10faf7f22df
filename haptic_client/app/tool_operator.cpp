#include "haptic_client/app/tool_operator.hpp"

#include "common/runtime/log.hpp"
#include "haptic_client/app/plan_file.hpp"
#include "haptic_client/simulation/played_pointer.hpp"

namespace osteon::haptic {

Result<ToolOperator> ToolOperator::make(const ToolOperatorOptions& options, const DeviceNotice& notice) {
  ToolOperator choice;
  choice.options_ = options;
  if (options.device.starts_with("recorded:") && options.device.size() > std::string_view("recorded:").size()) {
    Result<std::unique_ptr<RecordedDevice>> device =
        make_recorded_device(options.device.substr(std::string_view("recorded:").size()));
    if (!device) return failure(device.error().code, "--device: " + device.error().message);
    choice.recorded_ = std::move(*device);
    choice.simulated_ = {options.device, choice.recorded_->limits()};
  } else if (options.device == "pointer" || options.device.starts_with("pointer:")) {
    constexpr std::string_view kPointer = "pointer:";
    if (options.device.size() <= kPointer.size())
      return failure(ErrorCode::invalid_input,
                     "--device pointer: it needs the socket of a window; name it, pointer:SOCKET");
    // Its hand is simulated, so it shows all the force.
    choice.simulated_ = {"pointer", SimulatedDeviceParams{}.limits};
    if (options.plan.empty() && !options.tool.empty()) {
      Result<std::unique_ptr<PointerFeed>> feed = PointerFeed::start(options.device.substr(kPointer.size()), notice);
      if (!feed) return tl::unexpected(feed.error());
      choice.pointer_ = std::move(*feed);
    }
  } else if (const Result<SimulatedDeviceParams> simulated = find_simulated_device(options.device)) {
    choice.simulated_ = *simulated;
    if (options.plan.empty())
      return failure(ErrorCode::invalid_input, "--device " + options.device +
                                                   " has a simulated hand, which needs a --plan; name a device "
                                                   "for your own hand (osteon-haptic devices lists them) or give one");
  } else {
    Result<std::unique_ptr<CombinedDevice>> device = make_devices(options.device, options.devices);
    if (!device) return tl::unexpected(device.error());
    choice.person_ = std::move(*device);
  }
  if (options.plan.empty() == options.tool.empty())
    return failure(ErrorCode::invalid_input,
                   options.plan.empty()
                       ? "--tool is missing; name the tool for your hand, e.g. drill-3.2, or give a --plan"
                       : "--tool is for a hand without a plan; leave out --tool or --plan");
  // A plan's steps specify all this themselves.
  const std::pair<const char*, bool> said[] = {{"--law", options.law.has_value()},
                                               {"--wear", options.wear.has_value()},
                                               {"--view", options.view.has_value()},
                                               {"--at", options.at.has_value()},
                                               {"--rpm", options.spindle_rpm.has_value()}};
  for (const auto& [option, given] : said)
    if (given && !options.plan.empty())
      return failure(ErrorCode::invalid_input,
                     std::string(option) +
                         " is for a hand without a plan; leave it out, or write \"law\", \"wear\", \"entry\" "
                         "and \"spindle_rpm\" into the plan's steps");
  if (options.plan.empty()) {
    if (Result<void> taken = choice.take_tool(); !taken) return tl::unexpected(taken.error());
    if (Result<void> connected = choice.connect(notice); !connected) return tl::unexpected(connected.error());
    return choice;
  }
  if (choice.person_ || choice.simulated_.name == "pointer")
    return failure(
        ErrorCode::invalid_input,
        "--device " + options.device +
            " is held by a person, who needs no plan; leave out --plan and give --tool, or take --device simulated");
  if (choice.recorded_ && choice.recorded_->session().of_pointer())
    return failure(ErrorCode::invalid_input, "--device " + options.device +
                                                 " is of a pointer, whose hand had no plan; leave out --plan and give "
                                                 "the --tool that it began with, " +
                                                 choice.recorded_->session().tools.front());
  Result<std::vector<PlanStep>> plan = read_plan(options.plan);
  if (!plan) return tl::unexpected(plan.error());
  choice.plan_ = std::move(*plan);
  return choice;
}

Result<void> ToolOperator::take_tool() {
  const Result<Vec3> toward = read_view(options_.view.value_or("front"));
  if (!toward) return tl::unexpected(toward.error());
  free_ = {.tool = options_.tool,
           .spindle_rpm = options_.spindle_rpm.value_or(0.0),
           .wear = options_.wear.value_or(1.0),
           .law = options_.law.value_or(""),
           .toward = *toward,
           .at_mm = std::nullopt};
  if (options_.at) {
    const Result<Vec3> at = read_point(*options_.at, "--at");
    if (!at) return tl::unexpected(at.error());
    free_.at_mm = *at;
  }
  if (!(free_.spindle_rpm >= 0.0 && free_.spindle_rpm <= 200000.0))
    return failure(ErrorCode::invalid_input, "--rpm must be from 0 to 200000");
  // A tool that is not in the tool box may be the room's own.
  if (const Result<Tool> tool = find_tool(free_.tool))
    if (const Result<void> held = check_held(*tool); !held)
      return failure(held.error().code, "--tool: " + held.error().message);
  if (const Result<void> law = check_law(free_.tool, free_.law); !law)
    return failure(law.error().code, "--law: " + law.error().message);
  if (!(free_.wear >= 1.0 && free_.wear <= 5.0))
    return failure(ErrorCode::invalid_input, "--wear must be from 1, sharp, to 5");
  return {};
}

Result<void> ToolOperator::connect(const DeviceNotice& notice) {
  if (!person_) return {};
  for (const auto& part : person_->parts()) {
    connections_.push_back(std::make_unique<DeviceConnection>(*part, notice));
    if (const Result<void> started = connections_.back()->start(); !started)
      return failure(started.error().code, "--device " + std::string(part->name()) + ": " + started.error().message);
  }
  return {};
}

Result<ReadyPlan> ToolOperator::ready_on(const Case& bone, const ToolFinder& find) const {
  if (options_.plan.empty()) {
    Result<ReadyPlan> ready = make_free_hand(free_, bone, find);
    if (!ready) return failure(ready.error().code, "--tool " + options_.tool + ": " + ready.error().message);
    return ready;
  }
  Result<ReadyPlan> ready = make_ready(plan_, bone, find);
  if (!ready) return failure(ready.error().code, "the plan " + options_.plan.string() + ", " + ready.error().message);
  return ready;
}

Result<ReadyPlan> ToolOperator::pointed_ready_on(const Case& bone, const ToolBox& tools) const {
  std::vector<Tool> known;
  for (const ToolBox::Entry* entry : tools.entries()) known.push_back(entry->tool);
  Result<ReadyPlan> ready = make_pointed_hand(free_, bone, known);
  if (!ready) return failure(ready.error().code, "--tool " + options_.tool + ": " + ready.error().message);
  return ready;
}

Result<std::unique_ptr<Session>> ToolOperator::pointed_on(const Case& bone, const ToolBox& tools,
                                                          const ForceScaling& scaling) {
  Result<ReadyPlan> ready = pointed_ready_on(bone, tools);
  if (!ready) return tl::unexpected(ready.error());
  std::vector<Tool> held;
  for (const ToolModel& model : ready->tools) held.push_back(model.tool);
  pointer_->set_tools(std::move(held));
  return std::make_unique<PointerSession>(std::move(*ready), pointer_->exchange(), simulated_, scaling);
}

Result<ForceScaling> ToolOperator::played_on(const Case& bone, const ReadyPlan& ready, ForceScaling scaling) const {
  const RecordedSession& played = recorded_->session();
  std::vector<std::string> names;
  for (const ToolModel& model : ready.tools) names.push_back(model.tool.name);
  if (Result<void> suits =
          check_played(played, "--device " + options_.device, to_hex(bone.hash()), names, to_hex(plan_digest(ready)));
      !suits)
    return tl::unexpected(suits.error());
  if (played.start_hash.empty())
    log::warn("the recording does not say what bone it began on",
              {{"remedy", "make sure that the room's bone is in the same state as then"}});
  // The recorded hand reacted to a certain force; another force would not match it.
  const Result<ForceChoice> choice =
      find_force_choice(played.force_choice.empty() ? name(ForceChoice::proportional) : played.force_choice);
  if (!choice) return failure(choice.error().code, "--device " + options_.device + ": " + choice.error().message);
  if (options_.force_choice && *options_.force_choice != *choice)
    return failure(ErrorCode::invalid_input, "--device " + options_.device + " was recorded with --force-choice " +
                                                 std::string(name(*choice)) + "; leave out --force-choice");
  scaling.choice = *choice;
  if (*choice == ForceChoice::proportional && scaling.scale == 0.0) scaling.scale = played.force_scale;
  return scaling;
}

Result<std::unique_ptr<Session>> ToolOperator::on(const Case& bone, const ToolBox& tools, double force_scale) {
  ForceScaling scaling(force_scale, options_.force_choice.value_or(ForceChoice::proportional));
  if (pointer_) return pointed_on(bone, tools, scaling);
  const bool of_pointer = recorded_ && recorded_->session().of_pointer();
  Result<ReadyPlan> ready = of_pointer ? pointed_ready_on(bone, tools)
                                       : ready_on(bone, [&](std::string_view name) { return tools.find(name); });
  if (!ready) return tl::unexpected(ready.error());
  if (recorded_) {
    const Result<ForceScaling> played = played_on(bone, *ready, scaling);
    if (!played) return tl::unexpected(played.error());
    scaling = *played;
  }
  if (of_pointer) return std::make_unique<PlayedPointerSession>(std::move(*ready), *recorded_, scaling);
  if (options_.plan.empty()) {
    HapticDevice& device = person_ ? static_cast<HapticDevice&>(*person_) : *recorded_;
    return std::make_unique<FreeHandSession>(std::move(*ready), device, scaling);
  }
  auto session = std::make_unique<SimulatedSession>(std::move(*ready), simulated_, scaling);
  if (recorded_) session->play(*recorded_);
  return session;
}

std::string_view ToolOperator::device_name() const {
  return person_ ? person_->name() : std::string_view(simulated_.name);
}

std::vector<std::string_view> ToolOperator::pushed() const {
  return pointer_ ? pointer_->pushed() : std::vector<std::string_view>();
}

int ToolOperator::losses() const {
  int losses = 0;
  if (pointer_) losses += pointer_->losses();
  for (const auto& connection : connections_) losses += connection->losses();
  return losses;
}

}  // namespace osteon::haptic
