// Decides who may connect, and which call they may make. Checks the certificate in the handshake. Checks certificate,
// ticket and revocations at the beginning of every call. Repeats these checks several times a second for every open
// stream. This is the only place where a connection or a call is refused because of who makes it.
#pragma once
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "common/access/access_list.hpp"
#include "common/access/role_table.hpp"
#include "common/access/ticket.hpp"
#include "common/core/id.hpp"
#include "common/core/mutex.hpp"
#include "server/audit/audit_record.hpp"
#include "server/auth/call_rates.hpp"
#include "server/auth/connections.hpp"
#include "server/auth/peer_claims.hpp"
#include "server/auth/person_certificate.hpp"
#include "server/auth/refusals.hpp"

namespace grpc {
class ServerCredentials;
}

namespace osteon {

class AuditTrail;

// A person who was admitted.
struct Caller {
  std::string user;  // from the certificate
  std::string serial, ticket_id;
  std::string ticket_room;        // from the ticket; kAnyRoom: valid for every room
  Role ticket_role = Role::none;  // from the ticket
  Role role = Role::none;         // valid now
  UnixTime ends{};                // when the ticket ends
  TicketCheckKey ticket_key{};    // key that verifies the ticket
  UnixTime certificate_ends{};
  std::string room{};     // the room that the call named or meant; `role` is valid there
  std::string address{};  // where the call came from, in the form of address_of()
};

// Why a call or connection was refused.
struct Refusal {
  std::string_view reason;  // a fixed word, for counting
  bool is_known = false;    // the person is known, but may not do this
  std::string sentence;     // for the caller
  bool is_for_now = false;  // the same call may be made again later
};

// What the authorizer checks of a call.
struct CallClaims {
  PeerClaims peer{};          // from the connection
  std::string_view ticket{};  // metadata osteon-ticket; empty: none was sent
  std::string_view room{};    // metadata osteon-room-bin; empty: none was sent
  std::string_view method{};  // full name; empty: any method
  std::string_view about{};   // room that the message names if `room` and the ticket name none; empty: none
};

// An open stream. Destroying it says that the stream has ended; the authorizer may end it before that.
class OpenStream {
 public:
  virtual ~OpenStream() = default;
  [[nodiscard]] virtual Role role() const = 0;  // valid now
};

struct AuthorizerCounts {
  std::uint64_t admitted = 0, refused = 0, ended = 0, displaced = 0;  // calls, calls, streams, sessions
  std::size_t streams = 0;                                            // open now
};

// Any thread may call it.
class Authorizer {
 public:
  static constexpr std::chrono::milliseconds kLookEvery{250};
  using Now = std::function<UnixTime()>;

  // `folder` holds ca.pem, server.pem, server.key and tickets.pub, and access.txt and crl.pem if somebody was revoked.
  // All files are read again when they change. `counts` outlives the authorizer. Errors: not_found, invalid_input; the
  // sentence names the file.
  [[nodiscard]] static Result<std::unique_ptr<Authorizer>> open(const std::filesystem::path& folder,
                                                                RefusalCounts& counts, Now now = {});
  ~Authorizer();
  Authorizer(const Authorizer&) = delete;
  Authorizer& operator=(const Authorizer&) = delete;

  // Gives the room for a call that names none and has a ticket for every room. An empty name: there is no such room.
  // Call it before the first call is admitted.
  void set_only_room(std::function<std::string()> name) { only_room_ = std::move(name); }

  // Refuses tickets whose remaining life is longer than this. Zero: no limit. Call it before the first call is
  // admitted.
  void set_most_ticket_life(std::chrono::hours most) { most_ticket_life_ = most; }

  // Connections whose certificate is revoked are closed through `connections`, which outlives the authorizer. Call it
  // before the first call is admitted.
  void set_connections(Connections& connections) { connections_ = &connections; }

  // The trail records every refusal. It outlives the authorizer. Call it before the first call is admitted.
  void set_trail(AuditTrail& trail) { trail_ = &trail; }
  // What is known of the caller, whether the call is allowed or not. `room`: named by the call or its ticket.
  struct CallTrace {
    AuditIdentity who;
    std::string room;
  };
  [[nodiscard]] CallTrace trace_of(const CallClaims& call);

  // Mutual TLS, with this authorizer in every handshake. The authorizer outlives the server.
  [[nodiscard]] std::shared_ptr<grpc::ServerCredentials> credentials();

  // Checks the certificates of a connection, the client's first: whether the authority signed them and they admit
  // somebody. A refusal is counted and logged.
  [[nodiscard]] std::optional<Refusal> judge_handshake(std::string_view chain_pem);
  [[nodiscard]] tl::expected<Caller, Refusal> judge(const CallClaims& call);
  // The same. The result is counted; a refusal is logged once for each person and reason.
  [[nodiscard]] tl::expected<Caller, Refusal> admit(const CallClaims& call);
  // Counts and logs a call that is wrong before it can be judged.
  void note_refused(std::string_view reason, std::string_view sentence, const CallClaims& call);
  // A person began more calls than allowed. Closes their connections, and refuses new ones for kPause.
  static constexpr std::chrono::seconds kPause{60};
  void note_flood(const PeerClaims& peer);

  // Checks whether a caller may use an identity in a room again. `kind`: kind of client. Error denied: the identity
  // belongs to another person or role, or a newer identity of the same person replaced it.
  [[nodiscard]] Result<void> check_resume(const Caller& caller, const std::string& room, int kind,
                                          AuthorId author) const;
  // Makes this identity the caller's. An earlier identity of the same person, room and kind becomes invalid, and its
  // streams end. With `again`, the check of check_resume() is repeated in the same step, since a newer identity may
  // have joined in the meantime. If that check fails, nothing changes.
  enum class Coming { anew, again };
  Result<void> joined(const Caller& caller, const std::string& room, int kind, AuthorId author,
                      Coming coming = Coming::anew);
  [[nodiscard]] Result<void> check_author(const Caller& caller, const std::string& room, AuthorId author) const;
  // A room was closed: its identities are no longer valid.
  void forget_room(const std::string& room);

  // Rechecks the certificate and role of a call when its stream begins, and the identity `author` (null: none). The
  // check and the registration of the stream are one step, so no revocation is missed. `end` is called once, on the
  // authorizer's own thread, when the caller may no longer have the stream. It is not called after the result has been
  // destroyed, but may run while that happens.
  using End = std::function<void(const Refusal& why)>;
  using Entered = tl::expected<std::shared_ptr<OpenStream>, Refusal>;
  [[nodiscard]] Entered enter(const Caller& caller, const std::string& room, AuthorId author, std::string_view method,
                              End end);
  // The caller's role in another room than that of the call, if the ticket were for that room.
  [[nodiscard]] Role role_in(const Caller& caller, const std::string& room) const;
  [[nodiscard]] AuthorizerCounts counts() const;
  // Rechecks all open streams now.
  void look();

 private:
  class Watched;
  Authorizer(std::filesystem::path folder, RefusalCounts& counts, Now now);
  // Reads ca.pem and crl.pem. Returns true if they have changed.
  [[nodiscard]] Result<bool> read_authorities() OSTEON_REQUIRES(reading_);
  // Reads tickets.pub. Returns true if its keys have changed.
  [[nodiscard]] Result<bool> read_ticket_keys() OSTEON_REQUIRES(reading_);
  // Closes the connections whose certificate is revoked, and the connections that are not yet identified.
  void close_revoked();
  [[nodiscard]] std::optional<std::string> revoked(const std::string& serial, const std::string& user,
                                                   const std::string& ticket_id) const OSTEON_REQUIRES(mutex_);
  [[nodiscard]] bool is_paused(const std::string& user) const OSTEON_REQUIRES(mutex_);
  // Checks what can change while somebody is connected: revocations, expiry and roles. Sets the role that is valid now.
  [[nodiscard]] std::optional<Refusal> judge_again(Caller& caller, const std::string& room,
                                                   std::string_view method) const OSTEON_REQUIRES(mutex_);
  [[nodiscard]] std::optional<Refusal> judge_author(const Caller& caller, const std::string& room,
                                                    AuthorId author) const OSTEON_REQUIRES(mutex_);
  [[nodiscard]] Result<void> check_resume_locked(const Caller& caller, const std::string& room, int kind,
                                                 AuthorId author) const OSTEON_REQUIRES(mutex_);
  [[nodiscard]] Result<PersonCertificate> certificate_of(std::string_view pem) OSTEON_REQUIRES(mutex_);
  [[nodiscard]] Result<void> check_shown(const PeerClaims& peer) OSTEON_REQUIRES(mutex_);
  struct CheckedTicket {
    Ticket ticket;
    TicketCheckKey key;
  };
  [[nodiscard]] Result<CheckedTicket> ticket_of(std::string_view text) OSTEON_REQUIRES(mutex_);
  void refresh();
  void run();
  void audit_refusal(std::string_view reason, const CallClaims& call);

  const std::filesystem::path folder_;
  RefusalCounts& refusals_;
  const Now now_;
  std::function<std::string()> only_room_;
  std::chrono::hours most_ticket_life_{0};
  Connections* connections_ = nullptr;  // null: an authorizer without a server
  AuditTrail* trail_ = nullptr;         // null: nothing is recorded
  Mutex reading_{LockRank::access_reading};
  AccessFile access_ OSTEON_GUARDED_BY(reading_);
  // The fault that was logged last.
  std::string access_fault_ OSTEON_GUARDED_BY(reading_), authorities_fault_ OSTEON_GUARDED_BY(reading_),
      keys_fault_ OSTEON_GUARDED_BY(reading_);
  mutable Mutex mutex_{LockRank::authorizer};
  AccessList access_list_ OSTEON_GUARDED_BY(mutex_);
  std::vector<TicketCheckKey> ticket_keys_ OSTEON_GUARDED_BY(mutex_);
  std::shared_ptr<const Authorities> authorities_ OSTEON_GUARDED_BY(mutex_);  // shared with handshakes in progress
  std::set<std::string> listed_serials_ OSTEON_GUARDED_BY(mutex_);            // serial numbers on the revocation lists
  // Certificates in PEM that a proxy sent and that these authorities signed.
  std::set<std::string> checked_ OSTEON_GUARDED_BY(mutex_);
  // Until when, by user.
  std::map<std::string, std::chrono::steady_clock::time_point> paused_ OSTEON_GUARDED_BY(mutex_);
  // Time of the newest revocation, until all connections that were open then were checked.
  std::optional<std::chrono::steady_clock::time_point> revoked_at_ OSTEON_GUARDED_BY(mutex_);
  std::unordered_map<std::string, PersonCertificate> certificates_ OSTEON_GUARDED_BY(mutex_);  // recently seen, by PEM
  CallRates rates_ OSTEON_GUARDED_BY(mutex_);
  std::unordered_map<std::string, CheckedTicket> tickets_ OSTEON_GUARDED_BY(mutex_);  // recently seen, by text
  using Seat = std::tuple<std::string, std::string, int>;                             // room, user, kind
  std::map<Seat, AuthorId> seats_ OSTEON_GUARDED_BY(mutex_);
  struct Member {
    Seat seat;
    Role role = Role::none;  // the role that the room knows, from joining
  };
  std::map<std::pair<std::string, AuthorId>, Member> authors_ OSTEON_GUARDED_BY(mutex_);
  std::list<std::weak_ptr<Watched>> streams_ OSTEON_GUARDED_BY(mutex_);
  AuthorizerCounts counts_ OSTEON_GUARDED_BY(mutex_);
  CondVar wake_;
  bool end_ OSTEON_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace osteon
