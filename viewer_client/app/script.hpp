// The viewer's script. One command per line directs the camera, for a person, a test or the demo.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "common/core/id.hpp"
#include "common/core/result.hpp"
#include "common/geometry/pose.hpp"
#include "common/tools/annotation.hpp"
#include "viewer_client/scene/camera_view.hpp"
#include "viewer_client/scene/item_place.hpp"

namespace osteon {

struct WaitForSurface {};
struct WaitForSeq {
  RoomSeq room_seq;
};
struct LookAtWhole {};
struct LookFrom {
  CameraView view;
};
struct LookAtTool {
  double distance_mm = 0;
};
struct ShowTool {
  bool on = true;
};
struct SaveScreenshot {
  std::filesystem::path file;
};
struct SaveStatus {
  std::filesystem::path file;
};
struct Quit {};
struct WaitForBodies {
  std::size_t count = 0;
};
struct WaitForItems {
  std::size_t count = 0;
};

struct WaitForDrawn {
  std::size_t count = 0;
};

// Commands about the people of the room. WHO is a name or #NUMBER.
struct LookAs {
  std::string who;
};
struct Follow {
  std::string who;  // empty: follow nobody
};
struct Draw {
  AnnotationKind kind = AnnotationKind::pointer;
  std::vector<Vec3> points_mm;
  std::string words;
};
struct WipeOff {
  std::uint32_t annotation = 0;  // 0: all of one's own
};
struct Say {
  // "all", a name or #NUMBER. If nobody has this name, it is the first word of the text, sent to all.
  std::string who;
  std::string words;  // the rest of the text
};

// Requests to the room. Each is done when its event is drawn.
struct UndoLast {
  std::uint32_t count = 1;
};
struct RedoLast {
  std::uint32_t count = 1;
};
struct UndoTo {
  RoomSeq mark;
};
struct MarkMoment {
  std::string label;
};
struct TakeAway {
  BodyId body;
};
struct PlaceTool {
  std::string tool;
  ItemPlace where;
  BodyId body;
};
// Commands about a placed item. The room gave it its number.
struct MoveItem {
  std::uint32_t item = 0;
  ItemPlace where;
};
struct TurnItem {
  std::uint32_t item = 0;
  double turns = 0;
};
struct SeatItem {
  std::uint32_t item = 0;
  double most_mm = 20.0;
};
struct RemoveItem {
  std::uint32_t item = 0;
};
struct SaveBone {
  std::string file_name;  // empty: the server chooses the name
};
using RoomRequest = std::variant<UndoLast, RedoLast, UndoTo, MarkMoment, TakeAway, PlaceTool, MoveItem, TurnItem,
                                 SeatItem, RemoveItem, SaveBone>;

using Command =
    std::variant<WaitForSurface, WaitForSeq, WaitForBodies, WaitForItems, LookAtWhole, LookFrom, LookAtTool, ShowTool,
                 SaveScreenshot, SaveStatus, RoomRequest, WaitForDrawn, LookAs, Follow, Draw, WipeOff, Say, Quit>;

// Null for an empty line and for one that begins with #. Error invalid_input: names the expected form.
[[nodiscard]] Result<std::optional<Command>> parse_command(std::string_view line);

// Reads the lines of a file or of standard input as they arrive. Does not block.
class ScriptReader {
 public:
  // "-" is standard input. Error not_found: names the file.
  [[nodiscard]] static Result<ScriptReader> open(const std::string& file);
  // A script that is part of the program.
  [[nodiscard]] static ScriptReader of(std::string text);
  ScriptReader(ScriptReader&& other) noexcept;
  ScriptReader& operator=(ScriptReader&&) = delete;
  ~ScriptReader();

  // The next whole line, if one has arrived.
  [[nodiscard]] std::optional<std::string> next();
  // The end was reached and every line was taken.
  [[nodiscard]] bool ended() const;

 private:
  ScriptReader() = default;
  int descriptor_ = -1;  // -1: no file is open, or its end was reached
  std::string text_;     // received, but not yet taken
};

}  // namespace osteon
