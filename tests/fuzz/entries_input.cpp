#include "tests/fuzz/entries_input.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>

#include "server/storage/journal_entries.hpp"

namespace osteon::fuzz {
namespace {

constexpr std::size_t kHead = 4;  // bytes of a record before the entry's own bytes

class Changes {
 public:
  explicit Changes(std::mt19937& random) : random_(random) {}

  std::size_t below(std::size_t count) { return static_cast<std::size_t>(random_()) % count; }

  template <class T>
  void number(T& value) {
    if constexpr (std::is_floating_point_v<T>) {
      using Limits = std::numeric_limits<T>;
      constexpr std::array<T, 8> kOdd{0, 1, -1, T(1e-300), T(1e30), T(-1e308), Limits::infinity(), Limits::quiet_NaN()};
      value = below(2) ? kOdd[below(kOdd.size())] : value + T(0.1) * (static_cast<T>(below(200)) - T(100));
    } else {
      switch (below(6)) {
        case 0:
          value = std::numeric_limits<T>::max();
          break;
        case 1:
          value = std::numeric_limits<T>::min();
          break;
        case 2:
          value = static_cast<T>(T{1} << below(8 * sizeof(T) - 1));
          break;
        case 3:
          value = static_cast<T>(below(20));
          break;
        default: {
          const std::uint64_t step = 1 + below(9), before = static_cast<std::uint64_t>(value);
          value = static_cast<T>(below(2) ? before + step : before - step);
        }
      }
    }
  }
  template <class T>
  void one_of(std::vector<T>& list) {
    if (list.empty() || below(8) == 0) {
      const T one = list.empty() ? T{} : list[below(list.size())];
      list.insert(list.begin() + static_cast<std::ptrdiff_t>(below(list.size() + 1)), one);
    } else if (below(8) == 0) {
      list.erase(list.begin() + static_cast<std::ptrdiff_t>(below(list.size())));
    } else {
      change(list[below(list.size())]);
    }
  }

  void change(Coord& at) { number(below(3) == 0 ? at.x : below(2) ? at.y : at.z); }
  void change(RoomSeq& seq) { number(seq.value); }
  void change(Digest& digest) { number(digest.bytes[below(digest.bytes.size())]); }
  void change(QuantisedPose& knot) {
    if (below(3) == 0)
      number(knot.rotation[below(4)]);
    else
      number(knot.position[below(3)]);
  }
  void change(FieldLeaf& leaf) {
    switch (below(3)) {
      case 0:
        leaf.level = static_cast<int>(below(4));
        break;
      case 1: {
        change(leaf.origin);
        if (below(4)) leaf.origin = floor_to(leaf.origin, kLeafSize);
        break;
      }
      default:
        if (below(4) == 0) leaf.values.resize(leaf.is_constant() ? kLeafVoxels : 1, leaf.values[0]);
        number(leaf.values[below(leaf.values.size())]);
    }
  }
  void change(Mask& mask) {
    std::vector<FieldLeaf> leaves = *mask;
    if (leaves.empty()) leaves.push_back({BodyId{0}, 0, {}, {0}});
    one_of(leaves);
    if (below(4))
      std::ranges::sort(leaves, {}, [](const FieldLeaf& leaf) { return std::pair(leaf.level, leaf.origin); });
    mask = std::make_shared<const std::vector<FieldLeaf>>(std::move(leaves));
  }
  void change(SplitPiece& piece) {
    if (!piece.left) piece.left = std::make_shared<const std::vector<FieldLeaf>>();
    switch (below(4)) {
      case 0:
        number(piece.body.value);
        break;
      case 1:
        change(piece.reach.min);
        break;
      case 2:
        change(piece.reach.max);
        break;
      default:
        change(piece.left);
    }
  }

  void change(JoinEntry& join) {
    if (below(2))
      number(join.author.value);
    else if (below(2))
      join.role = static_cast<Role>(below(static_cast<std::size_t>(kRoles) + 1));
    else
      join.kind = static_cast<MemberKind>(below(3));
  }
  void change(CutEntry& entry) {
    Cut& cut = entry.cut;
    switch (below(9)) {
      case 0:
        number(cut.author.value);
        break;
      case 1:
        number(cut.author_seq);
        break;
      case 2:
        number(cut.body.value);
        break;
      case 3:
        cut.level = static_cast<int>(below(4));
        break;
      case 4:
        change(cut.tool);
        break;
      case 5:
        number(cut.spindle_rpm);
        break;
      case 6:
        number(cut.path_us);
        break;
      default:
        one_of(cut.path);
    }
  }
  void change(RejectionEntry& entry) {
    if (below(3) == 0)
      number(entry.author.value);
    else if (below(2))
      number(entry.author_seq);
    else
      entry.reason = static_cast<Rejection>(below(static_cast<std::size_t>(kRejections) + 1));
  }
  void change(SplitEntry& entry) {
    if (below(4) == 0)
      number(entry.parent.value);
    else if (below(2))
      change(entry.taken);
    else
      one_of(entry.pieces);
    for (SplitPiece& piece : entry.pieces)
      if (!piece.left) piece.left = std::make_shared<const std::vector<FieldLeaf>>();
  }
  void change(UndoEntry& entry) { one_of(entry.seqs); }
  void change(RedoEntry& entry) { one_of(below(2) ? entry.undos : entry.seqs); }
  void change(RemoveBodyEntry& entry) { number(entry.body.value); }
  void change(ItemEntry& entry) {
    if (!entry.set || below(4) == 0) return number(entry.item);
    SceneItem& item = *entry.set;
    switch (below(7)) {
      case 0:
        number(item.id);
        break;
      case 1:
        number(item.body.value);
        break;
      case 2:
        change(item.tool);
        break;
      case 3:
        number(item.turns);
        break;
      case 4:
        number(item.set_at);
        break;
      case 5:
        number(item.pose_bone_item.rotation.coeffs()[static_cast<int>(below(4))]);
        break;
      default:
        number(item.pose_bone_item.position_mm[static_cast<int>(below(3))]);
    }
  }
  void change(ToolEntry& entry) {
    Tool& tool = entry.tool;
    if (below(3) == 0) tool.name.push_back(static_cast<char>('a' + below(26)));
    const std::array<double*, 4> sizes{&tool.diameter_mm, &tool.cutting_length_mm, &tool.shank_length_mm,
                                       &tool.spindle_rpm};
    number(*sizes[below(sizes.size())]);
  }
  void change(MarkEntry& entry) {
    if (below(2))
      entry.label.resize(below(300), static_cast<char>('a' + below(26)));
    else
      entry.label.clear();
  }
  void change(std::string& words) {
    if (below(2))
      words.resize(below(1200), static_cast<char>('a' + below(26)));
    else
      words.clear();
  }
  void change(SuperviseEntry& entry) {
    Restrictions& set = entry.supervision;
    switch (below(9)) {
      case 0:
        number(entry.subject.value);
        break;
      case 1:
        set.stopped = !set.stopped;
        break;
      case 2:
        number(set.taken_by.value);
        break;
      case 3:
        number(set.guide.value);
        break;
      case 4:
        number(set.guide_share);
        break;
      case 5:
        number(set.force_limit);
        break;
      case 6:
        if (!set.zone) set.zone.emplace();
        number(below(2) ? set.zone->radius : set.zone->centre[below(3)]);
        break;
      case 7:
        one_of(set.tools);
        break;
      default:
        change(set.words);
    }
  }
  void change(AnnotationEntry& entry) {
    if (!entry.drawn || below(4) == 0) return number(entry.id);
    Annotation& drawn = *entry.drawn;
    switch (below(6)) {
      case 0:
        number(drawn.id);
        break;
      case 1:
        number(drawn.author.value);
        break;
      case 2:
        drawn.kind = static_cast<AnnotationKind>(below(7));
        break;
      case 3:
        number(drawn.colour);
        break;
      case 4:
        change(drawn.words);
        break;
      default:
        if (drawn.points.empty() || below(4) == 0)
          drawn.points.push_back({1, 2, 3});
        else
          number(drawn.points[below(drawn.points.size())][below(3)]);
    }
  }
  void change(WordsEntry& entry) {
    if (below(2))
      number(entry.to.value);
    else
      change(entry.words);
  }

 private:
  std::mt19937& random_;
};

void change_field(std::string& bytes, Changes& changes) {
  Result<LogEntry> entry = entry_from_bytes(RoomSeq{1}, {}, bytes);
  if (!entry) {
    if (!bytes.empty()) changes.number(bytes[changes.below(bytes.size())]);
    return;
  }
  std::visit([&](auto& what) { changes.change(what); }, entry->what);
  bytes = to_bytes(*entry);
}

}  // namespace

EntriesInput entries_input(std::span<const std::uint8_t> data) {
  EntriesInput input;
  if (data.size() < 2) return input;
  input.how = data[0], input.checkpoint = data[1];
  data = data.subspan(2);
  while (data.size() >= kHead) {
    const std::size_t asked = data[2] | std::size_t{data[3]} << 8;
    const auto bytes = data.subspan(kHead, std::min(asked, data.size() - kHead));
    input.records.push_back(
        {static_cast<std::int8_t>(data[0]), static_cast<std::int8_t>(data[1]), {bytes.begin(), bytes.end()}});
    data = data.subspan(kHead + bytes.size());
  }
  return input;
}

Bytes to_bytes(const EntriesInput& input) {
  Bytes out{input.how, input.checkpoint};
  for (const Record& record : input.records) {
    const std::size_t size = std::min<std::size_t>(record.bytes.size(), 0xffff);
    out.insert(out.end(), {static_cast<std::uint8_t>(record.off), static_cast<std::uint8_t>(record.later),
                           static_cast<std::uint8_t>(size), static_cast<std::uint8_t>(size >> 8)});
    out.insert(out.end(), record.bytes.begin(), record.bytes.begin() + static_cast<std::ptrdiff_t>(size));
  }
  return out;
}

std::chrono::nanoseconds time_of(const Record& record, std::chrono::nanoseconds before) {
  using Limits = std::numeric_limits<std::int8_t>;
  if (record.later == Limits::min()) return std::chrono::nanoseconds::min();
  if (record.later == Limits::max()) return std::chrono::nanoseconds::max();
  return before + record.later * kStep;
}

void change_entries(Bytes& data, std::mt19937& random) {
  EntriesInput input = entries_input(data);
  std::vector<Record>& records = input.records;
  if (records.empty()) return;
  Changes changes(random);
  const auto seq = [&](std::size_t extra = 0) {
    return records.begin() + static_cast<std::ptrdiff_t>(changes.below(records.size() + extra));
  };
  switch (changes.below(12)) {
    case 0:
      records.erase(seq());
      break;
    case 1: {
      Record again = *seq();
      records.insert(seq(1), std::move(again));
      break;
    }
    case 2:
      std::iter_swap(seq(), seq());
      break;
    case 3:
      changes.number(seq()->off);
      break;
    case 4:
      changes.number(seq()->later);
      break;
    case 5:
      changes.number(changes.below(2) ? input.how : input.checkpoint);
      break;
    default:
      change_field(seq()->bytes, changes);
  }
  data = to_bytes(input);
}

}  // namespace osteon::fuzz
