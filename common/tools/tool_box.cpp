#include "common/tools/tool_box.hpp"

#include <set>

namespace osteon {

const ToolBox::Entry& ToolBox::add(const Tool& tool) {
  const Digest hash = tool.hash();
  const MutexLock lock(mutex_);
  auto& entry = entries_[hash];
  if (!entry) entry = std::make_unique<const Entry>(Entry{hash, tool, tool.cut_body()});
  return *entry;
}

const ToolBox::Entry* ToolBox::find(const Digest& hash) const {
  const MutexLock lock(mutex_);
  const auto found = entries_.find(hash);
  return found == entries_.end() ? nullptr : found->second.get();
}

Result<Tool> ToolBox::find(std::string_view name) const {
  const Entry* found = nullptr;
  std::set<std::string> known;
  for (const Entry* entry : entries()) {
    known.insert(entry->tool.name);
    if (entry->tool.name != name) continue;
    if (found)
      return failure(ErrorCode::invalid_input, "two tools of the room have the name \"" + std::string(name) + '"');
    found = entry;
  }
  if (found) return found->tool;
  std::string list;
  for (const std::string& one : known) list += (list.empty() ? "" : ", ") + one;
  return failure(ErrorCode::not_found, "the room has no tool \"" + std::string(name) + "\"; choose one of " + list);
}

std::vector<const ToolBox::Entry*> ToolBox::entries() const {
  const MutexLock lock(mutex_);
  std::vector<const Entry*> all;
  for (const auto& [hash, entry] : entries_) all.push_back(entry.get());
  return all;
}

std::shared_ptr<ToolBox> builtin_tool_box() {
  auto box = std::make_shared<ToolBox>();
  for (const Tool& tool : builtin_tools()) box->add(tool);
  return box;
}

}  // namespace osteon
