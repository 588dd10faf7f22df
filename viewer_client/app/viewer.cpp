#include "viewer_client/app/viewer.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/core/overloaded.hpp"
#include "common/runtime/files.hpp"
#include "viewer_client/scene/camera_view.hpp"
#include "viewer_client/scene/gauges.hpp"
#include "viewer_client/scene/stroke.hpp"

namespace osteon {

namespace {

using Clock = std::chrono::steady_clock;

// How long a turn waits for the network. Mouse and script are polled once per turn.
constexpr std::chrono::milliseconds kTurn{10};
constexpr double kToolKeyDistance_mm = 120.0;
// How often the state of the people is read.
constexpr std::chrono::milliseconds kMeetings{50};

std::int64_t mono_ns(Clock::time_point at) { return std::chrono::nanoseconds(at.time_since_epoch()).count(); }

}  // namespace

Result<Viewer> Viewer::make(const ViewerOptions& options, BoneWindow& window, RenderQueue& render_queue,
                            std::optional<ScriptReader> script) {
  Viewer viewer(options, window, render_queue, std::move(script));
  if (!options.frame_log.empty()) {
    viewer.frame_log_.open(options.frame_log);
    viewer.frame_log_ << "room_seq,received_mono_ns,rendered_mono_ns\n" << std::flush;
    if (!viewer.frame_log_) {
      return failure(ErrorCode::internal,
                     "the frame log " + options.frame_log.string() + " cannot be written: " + std::strerror(errno));
    }
  }
  window.scene().look(overview(options.bounds));
  return viewer;
}

Viewer::Viewer(const ViewerOptions& options, BoneWindow& window, RenderQueue& render_queue,
               std::optional<ScriptReader> script)
    : options_(options),
      window_(&window),
      queue_(&render_queue),
      script_(std::move(script)),
      scene_(render_queue, window.scene()),
      people_(options.hand) {}

Result<Viewer::State> Viewer::turn(bool interrupted) {
  queue_->wait_for(kTurn);
  dirty_ = dirty_ || interrupted != interrupted_;
  interrupted_ = interrupted;

  const WindowEvents events = window_->events();
  if (events.closed) return State::finished;
  dirty_ = dirty_ || events.redraw;
  if (events.wants_overview) dirty_ = obey(LookAtWhole{}).has_value();
  if (events.wants_tool && !scene_.states().empty()) dirty_ = obey(LookAtTool{kToolKeyDistance_mm}).has_value();

  draw_by_hand(events);

  if (options_.cap) follow_cap();
  dirty_ = scene_.update(tool_shown_) || dirty_;
  meet_people();
  draw_if_due(false);
  auto state = obey_script();
  if (options_.looked) options_.looked(window_->scene().camera());
  return state;
}

void Viewer::follow_cap() {
  constexpr double kRest = 0.05, kLongestTurn_s = 0.1;
  constexpr std::uint32_t kWhole = 1, kTool = 2;
  const auto now = Clock::now();
  const double dt_s = std::min(kLongestTurn_s, std::chrono::duration<double>(now - capped_).count());
  capped_ = now;
  const SpaceMouseState cap = options_.cap();
  const std::uint32_t pressed = cap.buttons & ~cap_buttons_;
  cap_buttons_ = cap.buttons;
  if (pressed & kWhole) dirty_ = obey(LookAtWhole{}).has_value();
  if ((pressed & kTool) && !scene_.states().empty()) dirty_ = obey(LookAtTool{kToolKeyDistance_mm}).has_value();
  const Vec3 push = beyond_rest(cap.push, kRest), twist = beyond_rest(cap.twist, kRest);
  if (push.isZero() && twist.isZero()) return;
  window_->scene().look(held_by_cap(window_->scene().camera(), push, twist, dt_s));
  dirty_ = true;
}

void Viewer::meet_people() {
  const auto now = Clock::now();
  if (options_.people == nullptr || now < next_meeting_) return;
  next_meeting_ = now + kMeetings;
  const SupervisionClient& room = *options_.people;
  people_.take({room.people(), room.annotations(), room.words()}, room.self(), now);
  show_people(now);
  if (followed_.empty()) return;
  // If the followed person left or closed the viewer, the camera stays where it is.
  const Result<PersonSeen> person = people_.find(followed_, PeopleView::Fit::looking);
  if (!person || !person->look || person->look == look_taken_) return;
  look_taken_ = person->look;
  window_->scene().look(looking_as(*person->look, window_->scene().camera()));
  dirty_ = true;
}

void Viewer::show_people(Clock::time_point now) {
  if (people_.annotations() != drawn_) {
    drawn_ = people_.annotations();
    window_->scene().show_annotations(drawn_);
    dirty_ = true;
  }
  if (auto names = people_.names(); names != names_) {
    names_ = std::move(names);
    window_->scene().show_names(names_);
    dirty_ = true;
  }
  auto said = people_.notices(now);
  auto holding = people_.holding();
  if (said == said_ && holding == holding_) return;
  said_ = std::move(said);
  holding_ = std::move(holding);
  window_->scene().show_words(said_, holding_);
  dirty_ = true;
}

void Viewer::draw_by_hand(const WindowEvents& events) {
  const auto report = [this](const Result<void>& outcome) {
    if (!outcome) people_.tell(outcome.error().message, Clock::now());
    next_meeting_ = {};  // show the change at once
  };
  const auto only_outcome = [](const auto& result) { return result ? Result<void>{} : tl::unexpected(result.error()); };
  if (events.pointed) report(only_outcome(draw_for_all(AnnotationKind::pointer, {*events.pointed}, {})));
  if (!events.drawn.empty()) report(only_outcome(draw_for_all(AnnotationKind::line, events.drawn, {})));
  if (events.wants_wipe) report(*obey_people(WipeOff{}));
}

std::string Viewer::notice() const {
  if (interrupted_) return options_.case_title + "\nconnection lost, trying again";
  if (const auto percent = scene_.percent_received())
    return options_.case_title + "\nreceiving the surface, " + std::to_string(*percent) + " %";
  return options_.case_title;
}

void Viewer::draw_if_due(bool at_once) {
  if (dirty_ && (at_once || Clock::now() >= next_draw_)) draw_now();
  // Events that did not change the picture are already shown by the present picture.
  if (!dirty_ && surface_shown_ && scene_.any_arrivals()) log_shown(mono_ns(Clock::now()));
}

void Viewer::draw_now() {
  const auto begin = Clock::now();
  const auto states = scene_.states();
  const bool with_tool = tool_shown_ && !states.empty();
  window_->scene().show_tools(with_tool ? states : std::span<const CuttingState>{});
  window_->scene().show_text(with_tool ? gauge_text(states.front()) : std::string{}, notice());
  window_->draw();
  const auto end = Clock::now();

  dirty_ = false;
  ++frames_;
  // Where drawing is slow, leave a fifth of the time to the other programs of this machine.
  const std::chrono::duration<double> period(1.0 / options_.most_frames_hz);
  next_draw_ = std::max(begin + std::chrono::ceil<Clock::duration>(period), end + (end - begin) / 4);
  if (!scene_.complete()) return;
  frame_times_.record(end - begin);
  surface_shown_ = true;
  log_shown(mono_ns(end));
}

void Viewer::log_shown(std::int64_t rendered_mono_ns) {
  shown_seq_ = scene_.received_seq();
  const std::vector<Arrival> arrivals = scene_.take_arrivals();
  if (frame_log_.is_open()) {
    for (const Arrival& arrival : arrivals) {
      frame_log_ << arrival.room_seq.value << ',' << arrival.received_mono_ns << ',' << rendered_mono_ns << '\n';
    }
    frame_log_.flush();
  }
}

Result<Viewer::State> Viewer::obey_script() {
  while (script_) {
    if (!pending_) {
      const auto line = script_->next();
      if (!line) return script_->ended() ? State::finished : State::running;
      auto parsed = parse_command(*line);
      if (parsed && !*parsed) continue;
      if (!parsed) {
        if (options_.answers) std::printf("error %s\n", parsed.error().message.c_str());
        std::fflush(stdout);
        if (options_.stop_at_error) {
          return failure(ErrorCode::invalid_input, "script line `" + *line + "`: " + parsed.error().message);
        }
        continue;
      }
      pending_ = Pending{*line, std::move(**parsed)};
    }

    if (std::holds_alternative<Quit>(pending_->command)) {
      if (options_.answers) std::printf("ok quit\n");
      std::fflush(stdout);
      return State::finished;
    }
    const auto outcome = obey(pending_->command);
    if (!outcome) return State::running;
    if (options_.answers) {
      if (*outcome)
        std::printf("ok %s\n", pending_->line.c_str());
      else
        std::printf("error %s\n", outcome->error().message.c_str());
      std::fflush(stdout);
    }
    pending_.reset();
    if (!*outcome && options_.stop_at_error) return tl::unexpected(outcome->error());
  }
  return State::running;
}

std::optional<Result<void>> Viewer::obey(const Command& command) {
  using Answer = std::optional<Result<void>>;
  const auto done = [this] {
    dirty_ = true;
    return Answer(Result<void>{});
  };
  return std::visit(
      Overloaded{
          [&](const WaitForSurface&) { return surface_shown_ && !dirty_ ? Answer(Result<void>{}) : Answer{}; },
          [&](const WaitForSeq& wait) {
            return surface_shown_ && shown_seq_ >= wait.room_seq ? Answer(Result<void>{}) : Answer{};
          },
          [&](const WaitForBodies& wait) {
            return surface_shown_ && !dirty_ && scene_.bodies().size() == wait.count ? Answer(Result<void>{})
                                                                                     : Answer{};
          },
          [&](const WaitForItems& wait) {
            return surface_shown_ && !dirty_ && scene_.items().size() == wait.count ? Answer(Result<void>{}) : Answer{};
          },
          [&](const RoomRequest& request) { return obey_room(request); },
          [&](const WaitForDrawn& wait) {
            return surface_shown_ && !dirty_ && drawn_.size() == wait.count ? Answer(Result<void>{}) : Answer{};
          },
          [&](const LookAs&) { return obey_people(command); },
          [&](const Follow&) { return obey_people(command); },
          [&](const Draw&) { return obey_people(command); },
          [&](const WipeOff&) { return obey_people(command); },
          [&](const Say&) { return obey_people(command); },
          [&](const LookAtWhole&) {
            window_->scene().look(overview(options_.bounds));
            return done();
          },
          [&](const LookFrom& look) {
            window_->scene().look(look.view);
            return done();
          },
          [&](const LookAtTool& look) {
            if (scene_.states().empty()) {
              return Answer(failure(ErrorCode::unavailable, "there is no tool in the room to look at yet"));
            }
            window_->scene().look(beside_tool(scene_.states().front().pose_bone_tool, look.distance_mm));
            return done();
          },
          [&](const ShowTool& show) {
            tool_shown_ = show.on;
            return done();
          },
          [&](const SaveScreenshot& save) {
            draw_if_due(true);
            dirty_ = true;  // the next picture is a live one again
            return Answer(window_->scene().save_png(save.file));
          },
          [&](const SaveStatus& save) { return Answer(write_file(save.file, summary_json())); },
          [&](const Quit&) { return Answer(Result<void>{}); },
      },
      command);
}

std::optional<Result<void>> Viewer::obey_people(const Command& command) {
  using Outcome = Result<void>;
  if (options_.people == nullptr)
    return Outcome(failure(ErrorCode::unavailable, "this viewer has no room whose people it sees"));
  next_meeting_ = {};
  meet_people();
  if (const auto* look = std::get_if<LookAs>(&command)) return look_as(look->who);
  if (const auto* follow = std::get_if<Follow>(&command)) {
    const Outcome seen = follow->who.empty() ? Outcome{} : look_as(follow->who);
    if (seen) followed_ = follow->who;
    return seen;
  }
  if (const auto* draw = std::get_if<Draw>(&command)) {
    const auto annotation = draw_for_all(draw->kind, draw->points_mm, draw->words);
    if (!annotation) return Outcome(tl::unexpected(annotation.error()));
    pending_->line += ": annotation " + std::to_string(*annotation);
    return Outcome{};
  }
  if (const auto* wipe = std::get_if<WipeOff>(&command)) return options_.people->wipe_off(wipe->annotation);
  if (const auto* words = std::get_if<Say>(&command)) return say(*words);
  return Outcome{};
}

Result<void> Viewer::look_as(const std::string& who) {
  const Result<PersonSeen> person = people_.find(who, PeopleView::Fit::looking);
  if (!person) return tl::unexpected(person.error());
  if (!person->look)
    return failure(ErrorCode::unavailable, "nobody knows where " + who + " looks: they have no window open");
  look_taken_ = person->look;
  window_->scene().look(looking_as(*person->look, window_->scene().camera()));
  dirty_ = true;
  return {};
}

Result<std::uint32_t> Viewer::draw_for_all(AnnotationKind kind, const std::vector<Vec3>& points_mm,
                                           const std::string& words) {
  if (options_.people == nullptr) return failure(ErrorCode::unavailable, "this viewer has no room to draw for");
  Annotation drawn;
  drawn.kind = kind;
  for (const Vec3& point : points_mm) drawn.points.push_back(in_steps(point));
  drawn.words = words;
  drawn.colour = colour_of(options_.people->self());
  if (const Result<void> sound = check(drawn); !sound) return tl::unexpected(sound.error());
  return options_.people->draw(drawn);
}

Result<void> Viewer::say(const Say& say) {
  const auto to = [&](AuthorId addressee, const std::string& words) -> Result<void> {
    if (words.empty()) return failure(ErrorCode::invalid_input, "there are no words to say after `" + say.who + "`");
    const auto place = options_.people->say(addressee, words);
    return place ? Result<void>{} : tl::unexpected(place.error());
  };
  if (say.who == "all") return to({}, say.words);
  const Result<PersonSeen> person = people_.find(say.who);
  if (person) return to(person->author, say.words);
  if (say.who.starts_with('#')) return tl::unexpected(person.error());
  return to({}, say.words.empty() ? say.who : say.who + " " + say.words);
}

std::optional<Result<void>> Viewer::obey_room(const RoomRequest& request) {
  if (!asked_) {
    const Result<RoomAnswer> answer =
        options_.ask ? options_.ask(request) : failure(ErrorCode::unavailable, "this viewer has no room to ask");
    if (!answer) return Result<void>(tl::unexpected(answer.error()));
    if (std::holds_alternative<SaveBone>(request)) return Result<void>{};
    if (std::holds_alternative<MarkMoment>(request)) {  // a mark is not visible in the picture
      pending_->line += ": " + answer->said;
      return Result<void>{};
    }
    asked_ = *answer;
  }
  if (!surface_shown_ || shown_seq_ < asked_->place) return std::nullopt;
  if (asked_->events)
    pending_->line += ": " + std::to_string(*asked_->events) + (*asked_->events == 1 ? " event" : " events");
  if (!asked_->said.empty()) pending_->line += ": " + asked_->said;
  asked_.reset();
  return Result<void>{};
}

std::string Viewer::summary_json() const {
  const auto milliseconds = [](const DurationHistogram& times) {
    return nlohmann::ordered_json{{"p50", times.percentile_us(50) / 1000.0},
                                  {"p99", times.percentile_us(99) / 1000.0},
                                  {"max", times.max_us() / 1000.0}};
  };
  nlohmann::ordered_json bodies = nlohmann::ordered_json::array();
  for (const BodyId body : scene_.bodies()) bodies.push_back(body.value);
  nlohmann::ordered_json standing = nlohmann::ordered_json::array();
  for (const SceneItem& item : scene_.items()) {
    const Vec3 &at = item.pose_bone_item.position_mm, along = item.pose_bone_item.direction(Vec3::UnitZ());
    standing.push_back({{"item", item.id},
                        {"body", item.body.value},
                        {"tool_hash", to_hex(item.tool)},
                        {"at_mm", {at.x(), at.y(), at.z()}},
                        {"along", {along.x(), along.y(), along.z()}},
                        {"turns", item.turns},
                        {"seated", item.seated}});
  }
  const CameraView camera = window_->scene().camera();
  const SurfaceScene& surface = scene_.surface();
  const auto numbers = [](const Vec3& v) { return nlohmann::ordered_json{v.x(), v.y(), v.z()}; };
  const nlohmann::ordered_json summary{
      {"blocks", surface.blocks()},
      {"regions", surface.regions()},
      {"triangles", surface.triangles()},
      {"scene_mesh_hash", to_hex(surface.hash())},
      {"room_seq", shown_seq_.value},
      {"bodies", bodies},
      {"items", scene_.items().size()},
      {"standing", standing},
      {"camera", {{"eye_mm", numbers(camera.eye_mm)}, {"target_mm", numbers(camera.target_mm)}}},
      {"drawn", drawn_.size()},
      {"said", said_},
      {"holding", holding_},
      {"frames", frames_},
      {"frame_ms", milliseconds(frame_times_)},
      {"update_ms", milliseconds(scene_.update_times())},
      {"updates", scene_.update_times().count()},
      {"regions_rebuilt", scene_.regions_rebuilt()},
  };
  return summary.dump(2) + "\n";
}

}  // namespace osteon
