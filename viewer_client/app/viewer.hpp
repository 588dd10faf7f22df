// The render loop. It takes the data that the network threads received and rebuilds the regions that changed. It draws
// when the picture changed, and runs script commands between pictures.
#pragma once
#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/core/result.hpp"
#include "common/geometry/lattice.hpp"
#include "common/input/space_mouse_report.hpp"
#include "common/runtime/tick_stats.hpp"
#include "viewer_client/app/script.hpp"
#include "viewer_client/render/scene_updater.hpp"
#include "viewer_client/render/window.hpp"
#include "viewer_client/scene/people_view.hpp"
#include "viewer_client/scene/render_queue.hpp"
#include "viewer_client/scene/room_answer.hpp"

namespace osteon {

inline constexpr double kMostFrames_hz = 30.0;  // as often as the server sends surface

struct ViewerOptions {
  std::string case_title;
  Box bounds;                                     // of the bone
  std::filesystem::path frame_log;                // empty: none
  double most_frames_hz = kMostFrames_hz;         // pictures a second at most; a screenshot is extra
  bool answers = false;                           // print ok or error on standard output after each command
  bool stop_at_error = false;                     // a failed command ends the run
  std::function<void(const CameraView&)> looked;  // called after every turn with the window's view
  std::function<SpaceMouseState()> cap;           // moves the camera; first button: overview, second button: tool
  // Sends a request to the room and waits for its answer.
  std::function<Result<RoomAnswer>(const RoomRequest&)> ask;
  // of the room; must outlive the viewer. Null: people are not shown, and nothing is drawn for them.
  SupervisionClient* people = nullptr;
  std::string hand;  // the tool operator at this window, a name or #NUMBER; empty: nobody
};

// [render]
class Viewer {
 public:
  // Error internal: the frame log cannot be written.
  [[nodiscard]] static Result<Viewer> make(const ViewerOptions& options, BoneWindow& window, RenderQueue& render_queue,
                                           std::optional<ScriptReader> script);

  enum class State { running, finished };
  // One turn of the loop. Waits at most a few milliseconds for something to happen. `interrupted`: the client is
  // reconnecting. Error: the reason that the run ends.
  [[nodiscard]] Result<State> turn(bool interrupted);

  // Blocks, triangles, hash, sequence number and times as JSON.
  [[nodiscard]] std::string summary_json() const;

 private:
  Viewer(const ViewerOptions& options, BoneWindow& window, RenderQueue& render_queue,
         std::optional<ScriptReader> script);

  void follow_cap();
  void meet_people();
  void show_people(std::chrono::steady_clock::time_point now);
  void draw_by_hand(const WindowEvents& events);
  void draw_if_due(bool at_once);
  void draw_now();
  void log_shown(std::int64_t rendered_mono_ns);
  [[nodiscard]] Result<State> obey_script();
  // Null: not done yet; call again in the next turn.
  [[nodiscard]] std::optional<Result<void>> obey(const Command& command);
  [[nodiscard]] std::optional<Result<void>> obey_room(const RoomRequest& request);
  [[nodiscard]] std::optional<Result<void>> obey_people(const Command& command);
  [[nodiscard]] Result<void> look_as(const std::string& who);
  // The annotation's number.
  [[nodiscard]] Result<std::uint32_t> draw_for_all(AnnotationKind kind, const std::vector<Vec3>& points_mm,
                                                   const std::string& words);
  [[nodiscard]] Result<void> say(const Say& say);
  [[nodiscard]] std::string notice() const;

  ViewerOptions options_;
  BoneWindow* window_;
  RenderQueue* queue_;
  std::optional<ScriptReader> script_;
  std::ofstream frame_log_;
  std::chrono::steady_clock::time_point capped_;  // when the SpaceMouse was last read
  std::uint32_t cap_buttons_ = 0;

  SceneUpdater scene_;
  std::optional<RoomAnswer> asked_;  // the answer to the pending command
  bool tool_shown_ = true;
  bool interrupted_ = false;
  bool surface_shown_ = false;  // the whole surface was drawn
  RoomSeq shown_seq_;

  PeopleView people_;
  std::chrono::steady_clock::time_point next_meeting_{};
  std::vector<Annotation> drawn_;  // as the window shows them
  std::map<AuthorId, std::string> names_;
  std::vector<std::string> said_;
  std::string holding_;
  std::string followed_;  // whose view the camera follows; empty: nobody
  std::optional<ViewFrustum> look_taken_;

  struct Pending {
    std::string line;
    Command command;
  };
  std::optional<Pending> pending_;

  bool dirty_ = true;
  std::chrono::steady_clock::time_point next_draw_{};
  DurationHistogram frame_times_;
  std::uint64_t frames_ = 0;
};

}  // namespace osteon
