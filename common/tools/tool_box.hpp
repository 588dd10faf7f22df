// The tools that a room knows, by the hash of their definition. It only grows, so what find() gave stays valid.
#pragma once
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "common/tools/tool.hpp"

namespace osteon {

// Any thread.
class ToolBox {
 public:
  struct Entry {
    Digest hash;
    Tool tool;
    CutBody body;  // tool.cut_body(), made once
  };

  // The entry of this definition, new or already there.
  const Entry& add(const Tool& tool);
  [[nodiscard]] const Entry* find(const Digest& hash) const;  // null when unknown
  // The tool of this name. Errors: not_found (names those that there are), invalid_input (two bear it).
  [[nodiscard]] Result<Tool> find(std::string_view name) const;
  [[nodiscard]] std::vector<const Entry*> entries() const;  // in the order of their hashes

 private:
  mutable std::mutex mutex_;
  std::map<Digest, std::unique_ptr<const Entry>> entries_;
};

// A box with all builtin tools. Owners: every holder of a bone, in one process the same box.
[[nodiscard]] std::shared_ptr<ToolBox> builtin_tool_box();

}  // namespace osteon
