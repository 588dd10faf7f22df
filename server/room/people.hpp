// The people of a room as its entries have made them: what they may do, what was decided about them, what they have drawn.
#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "common/access/role.hpp"
#include "common/core/digest.hpp"
#include "common/field/restrictions.hpp"
#include "common/tools/annotation.hpp"
#include "server/room/log_entry.hpp"

namespace osteon {

inline constexpr std::size_t kMostWordsBytes = 1024;

class People {
 public:
  struct Supervised {
    Restrictions supervision;
    RoomSeq place;  // of the entry that set it
    AuthorId by;    // who did
  };

  void join(AuthorId author, Role role, std::uint32_t person, bool hand) { members_[author] = {role, person, hand}; }
  void supervise(RoomSeq place, AuthorId by, const SuperviseEntry& entry) {
    supervised_[entry.subject] = {entry.supervision, place, by};
  }
  void draw(const AnnotationEntry& entry);

  [[nodiscard]] Role role(AuthorId author) const;
  [[nodiscard]] std::uint32_t person(AuthorId author) const;  // a pseudonym, 0: unnamed
  // An author without a role may do whatever one with any role may: his room is from before there were roles, or his
  // server knows nobody by name.
  [[nodiscard]] bool supervises(AuthorId author) const;
  [[nodiscard]] bool only_own(AuthorId author) const { return role(author) == Role::trainee; }
  // Whether they may take back all that others did.
  [[nodiscard]] bool may_undo_all(AuthorId author) const;
  // Whether both are one person, as far as it is known who they are.
  [[nodiscard]] bool same_person(AuthorId a, AuthorId b) const {
    return a == b || (person(a) != 0 && person(a) == person(b));
  }
  // The hand of a person that came last, here or not; null: there is none, or nobody knows who it is (0).
  [[nodiscard]] AuthorId newest_hand(std::uint32_t person) const;
  // What holds for a hand; nothing but the default where nobody has decided anything.
  [[nodiscard]] const Supervised& supervised(AuthorId author) const;
  // What an author keeps to: what holds for it as a hand, then what holds for the newest hand of its person, unless it
  // may supervise others.
  [[nodiscard]] std::array<const Restrictions*, 2> binding(AuthorId author) const;
  [[nodiscard]] const std::map<std::uint32_t, Annotation>& annotations() const { return annotations_; }
  [[nodiscard]] std::uint32_t last_annotation() const { return last_annotation_; }
  // The one that a new drawing of this kind takes the place of; 0: none.
  [[nodiscard]] std::uint32_t replaced_by(const Annotation& drawn) const;

  // Adds nothing where nobody has a role, was supervised or has drawn anything: as the hash of a room was before there
  // were people.
  void add_to(Hasher& hasher) const;

 private:
  struct Member {
    Role role = Role::none;
    std::uint32_t person = 0;
    bool hand = false;
  };
  std::map<AuthorId, Member> members_;
  std::map<AuthorId, Supervised> supervised_;
  std::map<std::uint32_t, Annotation> annotations_;
  std::uint32_t last_annotation_ = 0;
};

}  // namespace osteon
