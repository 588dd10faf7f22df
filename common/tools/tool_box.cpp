#include "common/tools/tool_box.hpp"

namespace osteon {

const ToolBox::Entry& ToolBox::add(const Tool& tool) {
  const Digest hash = tool.hash();
  const std::lock_guard lock(mutex_);
  auto& entry = entries_[hash];
  if (!entry) entry = std::make_unique<const Entry>(Entry{hash, tool, tool.cut_body()});
  return *entry;
}

const ToolBox::Entry* ToolBox::find(const Digest& hash) const {
  const std::lock_guard lock(mutex_);
  const auto found = entries_.find(hash);
  return found == entries_.end() ? nullptr : found->second.get();
}

std::vector<const ToolBox::Entry*> ToolBox::entries() const {
  const std::lock_guard lock(mutex_);
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
