// The tools that a room knows, by the hash of their definition. Tools are never removed, so results of find() stay
// valid.
#pragma once
#include <map>
#include <memory>
#include <vector>

#include "common/core/mutex.hpp"
#include "common/tools/tool.hpp"

namespace osteon {

// Any thread.
class ToolBox {
 public:
  struct Entry {
    Digest hash;
    Tool tool;
    CutBody body;  // tool.cut_body(), computed once
  };

  // Returns the entry of this definition, new or existing.
  const Entry& add(const Tool& tool);
  [[nodiscard]] const Entry* find(const Digest& hash) const;  // null when unknown
  // The tool with this name. Errors: not_found (lists the existing names), invalid_input (two tools have this name).
  [[nodiscard]] Result<Tool> find(std::string_view name) const;
  [[nodiscard]] std::vector<const Entry*> entries() const;  // sorted by hash

 private:
  mutable Mutex mutex_{LockRank::leaf};
  std::map<Digest, std::unique_ptr<const Entry>> entries_ OSTEON_GUARDED_BY(mutex_);
};

// A box with all builtin tools. Owners: every holder of a bone; in one process they share the box.
[[nodiscard]] std::shared_ptr<ToolBox> builtin_tool_box();

}  // namespace osteon
