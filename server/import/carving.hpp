// Cuts a case's bone offline, and measures the costs of every step.
#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/surface/surface_blocks.hpp"
#include "common/volume/cut_field.hpp"
#include "common/volume/cut_history.hpp"
#include "common/volume/field_file.hpp"
#include "common/volume/fragments.hpp"
#include "server/import/carve_script.hpp"

namespace osteon::import {

struct StepReport {
  std::string tool;
  int level = 0;
  int cuts = 0;            // cuts that were made
  int metal_refused = 0;   // cuts that were refused because they would have removed metal
  double removed_mm3 = 0;  // by cutting, from all bodies; separated pieces are not counted
  std::int64_t visited = 0, computed = 0, modified = 0;  // samples of all bodies together (Niu 2008, §5.4)
  double cut_ms_median = 0, cut_ms_p99 = 0, cut_ms_most = 0;
  double frame_ms_median = 0, frame_ms_most = 0;  // time to mesh body 0's blocks that kCutsPerFrame cuts changed
  double fragment_ms = 0;                         // time to maintain the components and to detect fragments
  int pieces = 0;                                 // pieces that separated in this step, without debris
  double pieces_mm3 = 0;
  int debris = 0;
  double field_mb = 0;  // samples of all bodies' cut fields
};

// Cuts of one frame at 30 Hz, for a tool that cuts at 1 kHz.
inline constexpr int kCutsPerFrame = 33;

// A case's bone and what the steps have cut of it. Not synchronised.
class Carving {
 public:
  Carving(Case bone, double cut_mm);
  ~Carving();

  // Splits a path into cuts of at most `cut_mm` of the tip's path and 5 degrees. Error: cancelled.
  Result<StepReport> run(const CarveStep& step, const KeepGoing& keep_going);
  [[nodiscard]] const Case& bone() const { return bodies_.front().bone(); }
  // The bone after the steps, by common/volume/settled.hpp: the same for any order of the cuts that were made. A step's
  // report describes what separated in that step; later steps may have cut that up.
  [[nodiscard]] SavedFields fields();
  [[nodiscard]] const CutField& field(std::size_t body);
  [[nodiscard]] std::size_t bodies();

 private:
  void mesh_changes(int level, const std::vector<Coord>& leaves, bool last, std::vector<double>& frame_ms);
  void part(std::size_t body, StepReport& report);
  void note_taken(std::vector<FieldLeaf> mask);
  void settle();
  [[nodiscard]] double removed_mm3(std::size_t bodies) const;
  [[nodiscard]] double field_mb() const;

  double cut_mm_;
  std::shared_ptr<ToolBox> tools_;       // shared with the bodies' fields
  std::vector<CutField> bodies_;         // 0: the bone; others: separated pieces
  std::vector<FragmentFinder> finders_;  // one for each body; none after settle()
  CutHistory history_;                   // of body 0
  std::uint64_t events_ = 0;             // in the history
  std::vector<RoomSeq> taken_;           // events of the history: bone that separated as pieces and debris
  bool settled_ = true;
  SurfaceBlocks surface_;
  std::vector<BlockKey> stale_;
  int unmeshed_cuts_ = 0;
  std::uint64_t cuts_ = 0;
};

// The cuts of a path. Each starts at the end of the one before.
[[nodiscard]] std::vector<Cut> cuts_of(const CarveStep& step, const Digest& tool, int level, double cut_mm);

[[nodiscard]] std::string heading();
[[nodiscard]] std::string line(std::size_t number, const StepReport& report);
[[nodiscard]] std::string to_json(const std::vector<StepReport>& steps, const SavedFields& fields);

}  // namespace osteon::import
