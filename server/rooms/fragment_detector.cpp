#include "server/rooms/fragment_detector.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "common/core/mutex.hpp"

namespace osteon {

void FragmentDetector::begin(BodyId body) {
  std::vector<FieldLeaf> leaves;
  {
    const ReaderLock lock(mutex_);
    if (const CutField* field = room_.find_field(body)) leaves = field->leaf_places();
  }
  read_(leaves);
  CutField copy(room_.bone(), body, room_.tools());
  for (const FieldLeaf& leaf : leaves) copy.restore(leaf);
  FragmentFinder finder(copy);
  bodies_.emplace(body, Watched{std::move(copy), std::move(finder)});
}

std::vector<Separation> FragmentDetector::look() {
  std::vector<BodyLeaves> changes;
  std::vector<BodyId> present;
  std::uint64_t seen = 0;
  std::uint32_t next_body = 0;
  {
    const WriterLock lock(mutex_);
    changes = room_.take_changes();
    present = room_.bodies();
    seen = room_.bone_epoch();
    next_body = room_.next_body().value;
  }
  std::erase_if(bodies_, [&](const auto& entry) { return !std::ranges::binary_search(present, entry.first); });
  std::set<BodyId> touched;
  for (const BodyId body : present) {
    if (bodies_.contains(body)) continue;
    begin(body);
    touched.insert(body);
  }
  for (const BodyLeaves& change : changes) {
    const auto found = bodies_.find(change.body);
    if (found == bodies_.end()) continue;
    std::vector<FieldLeaf> leaves;
    leaves.reserve(change.origins.size());
    for (const Coord origin : change.origins) leaves.push_back({change.body, change.level, origin, {}});
    read_(leaves);
    for (const FieldLeaf& leaf : leaves) found->second.copy.restore(leaf);
    touched.insert(change.body);
  }
  // Only once the copies are complete: a change of one level also affects cells of a finer one.
  for (const BodyLeaves& change : changes)
    if (const auto found = bodies_.find(change.body); found != bodies_.end())
      found->second.finder.touch(found->second.copy, change.level, change.origins);
  std::vector<Separation> found;
  for (const BodyId body : touched) {
    Watched& watched = bodies_.at(body);
    std::vector<Fragment> fragments = watched.finder.take_fragments(watched.copy);
    if (fragments.empty()) continue;
    found.push_back(separation(body, watched, std::move(fragments), next_body));
    found.back().seen = seen;
  }
  return found;
}

Separation FragmentDetector::separation(BodyId body, const Watched& watched, std::vector<Fragment> fragments,
                                        std::uint32_t& next_body) const {
  Separation result{body, std::move(fragments)};
  std::vector<FieldLeaf> leaves;
  for (const Fragment& fragment : result.fragments) {
    if (fragment.debris()) continue;
    if (leaves.empty()) leaves = watched.copy.leaves();
    CutField field(room_.bone(), BodyId{next_body++}, room_.tools());
    for (const FieldLeaf& leaf : leaves) field.restore(leaf);
    for (const FieldLeaf& mask : fragment.left) field.merge(mask);
    result.fields.push_back(std::move(field));
  }
  return result;
}

}  // namespace osteon
