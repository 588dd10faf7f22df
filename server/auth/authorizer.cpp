#include "server/auth/authorizer.hpp"

#include <grpcpp/grpcpp.h>
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_certificate_verifier.h>
#include <grpcpp/security/tls_credentials_options.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>

#include "common/runtime/log.hpp"
#include "common/runtime/secret_file.hpp"
#include "server/audit/audit_trail.hpp"

namespace osteon {
namespace {

constexpr std::size_t kMostRemembered = 4096;  // certificates, and tickets
constexpr unsigned kCertificatesEverySeconds = 1;
constexpr std::chrono::seconds kFirstCall{2};  // after a revocation, for connections without a call
constexpr std::string_view kPaused = "too many calls came from you; wait a minute";
constexpr std::string_view kTooOften =
    "that is called too often; wait a second between calls, since who goes on loses all connections for a minute";

UnixTime system_now() { return std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now()); }

Result<std::string> read_all(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  if (in && !text.empty()) return text;
  std::error_code unknown;
  const std::filesystem::path folder = file.parent_path();
  if (std::filesystem::exists(folder / "person.pem", unknown) || std::filesystem::exists(folder / "people", unknown))
    return failure(ErrorCode::not_found, folder.string() +
                                             " is no folder of a server; give the one that deploy/certs " +
                                             "server made, such as certs/server");
  return failure(ErrorCode::not_found, file.string() + " cannot be read; deploy/certs makes what --certificates needs");
}

// The keys of an authority do not belong in this folder. Warns about them too, in case somebody copied them here.
void warn_of_readable_secrets(const std::filesystem::path& folder) {
  for (const char* name : {"server.key", "proxy.pem", "tickets.key", "ca.key"})
    if (const auto why = who_else_reads(folder / name)) log::warn("READABLE SECRET KEY", {{"fault", *why}});
}

std::string article(Role role) {
  const std::string name(to_string(role));
  return (std::string_view("aeiou").find(name.front()) == std::string_view::npos ? "a " : "an ") + name;
}

std::string changed_role(Role role) {
  return "your role has changed to " + std::string(to_string(role)) + "; join anew";
}

template <class Map>
void make_space(Map& map) {
  if (map.size() >= kMostRemembered) map.clear();
}

// gRPC calls it once in every handshake, after the client has proved that it has the key of its certificate. gRPC is
// set to accept any certificate. Its own check would not say why a certificate is refused, and would not apply a new
// revocation at once.
class HandshakeCheck final : public grpc::experimental::ExternalCertificateVerifier {
 public:
  explicit HandshakeCheck(Authorizer& authorizer) : authorizer_(authorizer) {}
  bool Verify(grpc::experimental::TlsCustomVerificationCheckRequest* request, std::function<void(grpc::Status)>,
              grpc::Status* at_once) override {
    // On a server, OpenSSL stores the client's own certificate separately from the others of its chain.
    const grpc::string_ref own = request->peer_cert(), others = request->peer_cert_full_chain();
    const std::string chain = std::string(own.data(), own.size()) + std::string(others.data(), others.size());
    const std::optional<Refusal> why = authorizer_.judge_handshake(chain);
    if (why) *at_once = {grpc::StatusCode::UNAUTHENTICATED, why->sentence};
    return true;
  }
  void Cancel(grpc::experimental::TlsCustomVerificationCheckRequest*) override {}

 private:
  Authorizer& authorizer_;
};

}  // namespace

class Authorizer::Watched final : public OpenStream {
 public:
  Watched(Authorizer& authorizer, Caller who, std::string in, AuthorId as, std::string_view what, End when)
      : caller(std::move(who)),
        room(std::move(in)),
        author(as),
        method(what),
        authorizer_(authorizer),
        end_(std::move(when)),
        role_(caller.role) {}
  ~Watched() override {
    const MutexLock lock(authorizer_.mutex_);
    authorizer_.streams_.remove_if([](const std::weak_ptr<Watched>& stream) { return stream.expired(); });
  }
  Role role() const override { return role_; }
  void set_role(Role role) { role_ = role; }
  [[nodiscard]] bool ended() const { return ended_; }
  // Called once.
  void end(const Refusal& why) {
    role_ = Role::none;
    if (!ended_.exchange(true)) end_(why);
  }

  Caller caller;  // under the authorizer's mutex
  const std::string room;
  const AuthorId author;
  const std::string method;

 private:
  Authorizer& authorizer_;
  const End end_;
  std::atomic<bool> ended_ = false;
  std::atomic<Role> role_;
};

Authorizer::Authorizer(std::filesystem::path folder, RefusalCounts& counts, Now now)
    : folder_(std::move(folder)),
      refusals_(counts),
      now_(now ? std::move(now) : Now(system_now)),
      access_(folder_ / "access.txt") {}

Authorizer::~Authorizer() {
  if (!thread_.joinable()) return;
  {
    const MutexLock lock(mutex_);
    end_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

Result<std::unique_ptr<Authorizer>> Authorizer::open(const std::filesystem::path& folder, RefusalCounts& counts,
                                                     Now now) {
  const Result<std::string> authority = read_all(folder / "ca.pem"), certificate = read_all(folder / "server.pem"),
                            secret = read_all(folder / "server.key");
  for (const auto* file : {&authority, &certificate, &secret})
    if (!*file) return tl::unexpected(file->error());
  if (const Result<void> pair = check_key_pair(*certificate, *secret); !pair)
    return failure(ErrorCode::invalid_input, (folder / "server.pem").string() + " and server.key: " +
                                                 pair.error().message + "; make both anew with deploy/certs server");
  warn_of_readable_secrets(folder);
  std::unique_ptr<Authorizer> authorizer(new Authorizer(folder, counts, std::move(now)));
  {
    const MutexLock reading(authorizer->reading_);
    if (const Result<bool> read = authorizer->read_ticket_keys(); !read) return tl::unexpected(read.error());
    // A wrong list at the start would admit people whom it should keep out.
    if (const Result<bool> read = authorizer->access_.refresh(); !read) return tl::unexpected(read.error());
    if (const Result<bool> read = authorizer->read_authorities(); !read) return tl::unexpected(read.error());
    const MutexLock lock(authorizer->mutex_);
    authorizer->access_list_ = authorizer->access_.list();
  }
  authorizer->thread_ = std::thread([raw = authorizer.get()] { raw->run(); });
  return authorizer;
}

std::shared_ptr<grpc::ServerCredentials> Authorizer::credentials() {
  // These files are read again while the server runs. A renewed certificate does not disturb open connections.
  const auto files = std::make_shared<grpc::experimental::FileWatcherCertificateProvider>(  // shared with gRPC
      (folder_ / "server.key").string(), (folder_ / "server.pem").string(), (folder_ / "ca.pem").string(),
      kCertificatesEverySeconds);
  grpc::experimental::TlsServerCredentialsOptions options(files);
  options.watch_root_certs();
  options.watch_identity_key_cert_pairs();
  // HandshakeCheck verifies the whole chain.
  options.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_BUT_DONT_VERIFY);
  options.set_certificate_verifier(grpc::experimental::ExternalCertificateVerifier::Create<HandshakeCheck>(*this));
  return grpc::experimental::TlsServerCredentials(options);
}

std::optional<Refusal> Authorizer::judge_handshake(std::string_view chain_pem) {
  std::shared_ptr<const Authorities> authorities;
  {
    const MutexLock lock(mutex_);
    authorities = authorities_;
  }
  std::optional<Refusal> refusal;
  const auto chain = check_client_chain(chain_pem, *authorities, now_());
  const Result<PersonCertificate> certificate = read_person_certificate(chain_pem);
  if (!chain) {
    const bool is_revoked = chain.error().fault == ChainFault::revoked;
    refusal = Refusal{is_revoked ? "revoked" : "certificate", false, chain.error().sentence};
  } else if (!certificate) {
    refusal = Refusal{"certificate", false, certificate.error().message};
  } else {
    const MutexLock lock(mutex_);
    if (const auto why = revoked(certificate->serial, certificate->user, {}))
      refusal = Refusal{"revoked", false, *why};
    else if (is_paused(certificate->user))
      refusal = Refusal{"flood", true, std::string(kPaused)};
  }
  if (!refusal) return {};
  // The name in an invalid chain is only a claim. A revoked chain is valid otherwise.
  const bool is_verified = chain || chain.error().fault == ChainFault::revoked;
  std::string who =
      certificate ? certificate->user + ", certificate " + certificate->serial : "a certificate without a name";
  if (!is_verified && certificate) who = "an unauthenticated client that claims to be " + who;
  const std::string from = connections_ ? some_addresses(*connections_) : "";
  refusals_.note(refusal->reason, who, refusal->sentence, from);
  if (trail_) {
    AuditEvent event{
        .who = {.address = from}, .action = "handshake", .result = kRefused, .detail = std::string(refusal->reason)};
    if (certificate) {
      event.who.person = is_verified ? certificate->user : std::string(kClaimed) + certificate->user;
      event.who.certificate = certificate->serial;
    }
    trail_->record(std::move(event));
  }
  return refusal;
}

Authorizer::CallTrace Authorizer::trace_of(const CallClaims& call) {
  CallTrace trace{.who = {.address = call.peer.address}, .room = std::string(call.room)};
  const MutexLock lock(mutex_);
  if (const Result<PersonCertificate> certificate = certificate_of(call.peer.certificate_pem)) {
    trace.who.person = check_shown(call.peer) ? certificate->user : std::string(kClaimed) + certificate->user;
    trace.who.certificate = certificate->serial;
  }
  if (call.ticket.empty()) return trace;
  if (const Result<CheckedTicket> checked = ticket_of(call.ticket)) {
    trace.who.ticket = to_hex(checked->ticket.id);
    if (trace.room.empty()) trace.room = checked->ticket.room;
  }
  return trace;
}

void Authorizer::audit_refusal(std::string_view reason, const CallClaims& call) {
  if (!trail_) return;
  CallTrace trace = trace_of(call);
  trail_->record({.who = std::move(trace.who),
                  .action = std::string(call_name(call.method)),
                  .object = std::move(trace.room),
                  .result = kRefused,
                  .detail = std::string(reason)});
}

Result<PersonCertificate> Authorizer::certificate_of(std::string_view pem) {
  if (const auto known = certificates_.find(std::string(pem)); known != certificates_.end()) return known->second;
  Result<PersonCertificate> read = read_person_certificate(pem);
  if (!read) return read;
  make_space(certificates_);
  return certificates_.emplace(pem, std::move(*read)).first->second;
}

// The handshake has checked certificates that came over TLS. Those that a proxy sends are checked here, so that a
// mistake in the proxy's configuration admits nobody.
Result<void> Authorizer::check_shown(const PeerClaims& peer) {
  if (!peer.by_proxy || checked_.contains(peer.certificate_pem)) return {};
  const auto chain = check_client_chain(peer.certificate_pem, *authorities_, now_());
  if (!chain) return failure(ErrorCode::denied, chain.error().sentence);
  make_space(checked_);
  checked_.insert(peer.certificate_pem);
  return {};
}

Result<Authorizer::CheckedTicket> Authorizer::ticket_of(std::string_view text) {
  if (const auto known = tickets_.find(std::string(text)); known != tickets_.end()) return known->second;
  Result<Ticket> opened;
  for (const TicketCheckKey& key : ticket_keys_) {
    opened = open_ticket(text, key);
    if (!opened) continue;
    make_space(tickets_);
    return tickets_.emplace(text, CheckedTicket{std::move(*opened), key}).first->second;
  }
  return tl::unexpected(opened.error());
}

std::optional<Refusal> Authorizer::judge_again(Caller& caller, const std::string& room, std::string_view method) const {
  const UnixTime now = now_();
  if (now >= caller.certificate_ends)
    return Refusal{"certificate", false, "the certificate has expired; ask for a new one"};
  if (const auto why = revoked(caller.serial, caller.user, caller.ticket_id)) return Refusal{"revoked", false, *why};
  if (std::ranges::find(ticket_keys_, caller.ticket_key) == ticket_keys_.end())
    return Refusal{"ticket", false,
                   "the key that signed the ticket was replaced; ask whoever runs the server for a new ticket"};
  Ticket ticket;
  ticket.expires = caller.ends;
  if (const Result<void> in_time = check_time(ticket, now); !in_time)
    return Refusal{"ticket", false, in_time.error().message};
  caller.role = access_list_.role(caller.user, room, caller.ticket_role);
  if (method.empty() || may_call(caller.role, method)) return {};
  if (!find_call(method)) return Refusal{"call", true, "this server has no such call"};
  return Refusal{"role", true,
                 article(caller.role) + " may not call " + std::string(call_name(method)) +
                     "; ask whoever runs the server for a ticket of another role"};
}

std::optional<std::string> Authorizer::revoked(const std::string& serial, const std::string& user,
                                               const std::string& ticket_id) const {
  if (listed_serials_.contains(serial)) return "the certificate was revoked; ask for a new one";
  return access_list_.refuses(serial, user, ticket_id);
}

bool Authorizer::is_paused(const std::string& user) const {
  const auto found = paused_.find(user);
  return found != paused_.end() && std::chrono::steady_clock::now() < found->second;
}

tl::expected<Caller, Refusal> Authorizer::judge(const CallClaims& call) {
  const MutexLock lock(mutex_);
  const auto refused = [](std::string_view reason, bool is_known, std::string sentence) {
    return tl::unexpected(Refusal{reason, is_known, std::move(sentence)});
  };
  if (const Result<void> shown = check_shown(call.peer); !shown)
    return refused("certificate", false, shown.error().message);
  const Result<PersonCertificate> certificate = certificate_of(call.peer.certificate_pem);
  if (!certificate) return refused("certificate", false, certificate.error().message);
  if (call.ticket.empty()) return refused("ticket", false, "no ticket came with the call; give one with --ticket FILE");
  const Result<CheckedTicket> checked = ticket_of(call.ticket);
  if (!checked) return refused("ticket", false, checked.error().message);
  const Ticket* ticket = &checked->ticket;
  if (const Result<void> short_enough = check_life(*ticket, now_(), most_ticket_life_); !short_enough)
    return refused("ticket", false, short_enough.error().message);
  if (ticket->user != certificate->user)
    return refused(
        "person", true,
        "the ticket is for " + ticket->user + " and the certificate for " + certificate->user + "; come with your own");
  if (!call.room.empty())
    if (const Result<void> here = check_room(*ticket, call.room); !here)
      return refused("room", true, here.error().message);
  Caller caller{.user = certificate->user,
                .serial = certificate->serial,
                .ticket_id = to_hex(ticket->id),
                .ticket_room = ticket->room,
                .ticket_role = ticket->role,
                .role = ticket->role,
                .ends = ticket->expires,
                .ticket_key = checked->key,
                .certificate_ends = certificate->ends,
                .address = call.peer.address};
  // A role may hold in one room only, so the room must be known here, however the call names it.
  std::string room(call.room.empty() ? std::string_view(ticket->room) : call.room);
  if (room == kAnyRoom && !call.about.empty()) room = call.about;
  if (room == kAnyRoom && only_room_) room = only_room_();
  if (std::optional<Refusal> refusal = judge_again(caller, room, call.method))
    return tl::unexpected(std::move(*refusal));
  caller.room = std::move(room);
  return caller;
}

tl::expected<Caller, Refusal> Authorizer::admit(const CallClaims& call) {
  auto caller = judge(call);
  std::string who = "a certificate without a name";
  {
    const MutexLock lock(mutex_);
    if (const Result<PersonCertificate> certificate = certificate_of(call.peer.certificate_pem)) {
      who = certificate->user;
      if (connections_ && !call.peer.by_proxy)
        connections_->identify(call.peer.peer, certificate->user, certificate->serial);
    }
    if (caller && is_paused(caller->user))
      caller = tl::unexpected(Refusal{"flood", true, std::string(kPaused), true});
    else if (caller && !rates_.take(caller->user, call.method, std::chrono::steady_clock::now()))
      caller = tl::unexpected(Refusal{"rate", true, std::string(kTooOften), true});
    ++(caller ? counts_.admitted : counts_.refused);
    if (caller) return caller;
  }
  refusals_.note(caller.error().reason, who, caller.error().sentence, call.peer.address);
  audit_refusal(caller.error().reason, call);
  return caller;
}

void Authorizer::note_refused(std::string_view reason, std::string_view sentence, const CallClaims& call) {
  {
    const MutexLock lock(mutex_);
    ++counts_.refused;
  }
  refusals_.note(reason, "an unauthenticated client", sentence, call.peer.address);
  audit_refusal(reason, call);
}

void Authorizer::note_flood(const PeerClaims& peer) {
  const bool is_open = !connections_ || peer.by_proxy || connections_->is_open(peer.peer);
  std::string who = "an unauthenticated client";
  {
    const MutexLock lock(mutex_);
    if (const Result<PersonCertificate> certificate = certificate_of(peer.certificate_pem)) {
      who = certificate->user;
      const auto now = std::chrono::steady_clock::now();
      std::erase_if(paused_, [now](const auto& entry) { return entry.second < now; });
      // gRPC had read this call before the connection was closed, and its flood is noted already.
      if (!is_open && paused_.contains(who)) return;
      paused_[who] = now + kPause;
    }
  }
  refusals_.note("flood", who, "more calls than a person may begin; their connections were closed", peer.address);
  audit_refusal("flood", {.peer = peer});
  if (connections_)
    connections_->close_if([&](const Connection& one) { return one.peer == peer.peer || one.user == who; });
}

Result<void> Authorizer::check_resume(const Caller& caller, const std::string& room, int kind, AuthorId author) const {
  const MutexLock lock(mutex_);
  return check_resume_locked(caller, room, kind, author);
}

Result<void> Authorizer::check_resume_locked(const Caller& caller, const std::string& room, int kind,
                                             AuthorId author) const {
  const Seat seat{room, caller.user, kind};
  if (const auto known = authors_.find({room, author}); known != authors_.end()) {
    if (known->second.seat != seat)
      return failure(ErrorCode::denied, "author " + std::to_string(author.value) + " is another person's; join anew");
    if (known->second.role != caller.role) return failure(ErrorCode::denied, changed_role(caller.role));
  }
  if (const auto taken = seats_.find(seat); taken != seats_.end() && taken->second != author)
    return failure(ErrorCode::denied,
                   "a newer session of " + caller.user + " took the place of this one; join anew to take it back");
  return {};
}

Result<void> Authorizer::joined(const Caller& caller, const std::string& room, int kind, AuthorId author,
                                Coming coming) {
  std::vector<std::shared_ptr<Watched>> held, displaced;  // destroyed without the lock, since their destructors take it
  {
    const MutexLock lock(mutex_);
    if (coming == Coming::again)
      if (Result<void> may = check_resume_locked(caller, room, kind, author); !may) return may;
    const Seat seat{room, caller.user, kind};
    AuthorId& sitting = seats_[seat];
    if (sitting && sitting != author) {
      ++counts_.displaced;
      // A room of the same name may have been made since, and the number may belong to somebody else there.
      const auto known = authors_.find({room, sitting});
      if (known != authors_.end() && known->second.seat == seat) authors_.erase(known);
      for (const std::weak_ptr<Watched>& weak : streams_) held.push_back(weak.lock());
      std::ranges::copy_if(held, std::back_inserter(displaced), [&](const std::shared_ptr<Watched>& stream) {
        return stream && stream->room == room && stream->author == sitting && stream->caller.user == caller.user;
      });
    }
    sitting = author;
    authors_[{room, author}] = {seat, caller.role};
  }
  const Refusal why{"displaced", true, "a newer session of " + caller.user + " took the place of this one"};
  for (const std::shared_ptr<Watched>& stream : displaced) stream->end(why);
  return {};
}

std::optional<Refusal> Authorizer::judge_author(const Caller& caller, const std::string& room, AuthorId author) const {
  const auto known = authors_.find({room, author});
  if (known == authors_.end() || std::get<1>(known->second.seat) != caller.user)
    return Refusal{"author", true,
                   "author " + std::to_string(author.value) + " is not yours in this room, or no more; join anew"};
  if (known->second.role != caller.role) return Refusal{"role", true, changed_role(caller.role)};
  return {};
}

Result<void> Authorizer::check_author(const Caller& caller, const std::string& room, AuthorId author) const {
  const MutexLock lock(mutex_);
  if (const std::optional<Refusal> why = judge_author(caller, room, author))
    return failure(ErrorCode::denied, why->sentence);
  return {};
}

void Authorizer::forget_room(const std::string& room) {
  const MutexLock lock(mutex_);
  std::erase_if(seats_, [&](const auto& seat) { return std::get<0>(seat.first) == room; });
  std::erase_if(authors_, [&](const auto& author) { return author.first.first == room; });
}

Authorizer::Entered Authorizer::enter(const Caller& caller, const std::string& room, AuthorId author,
                                      std::string_view method, End end) {
  auto stream = std::make_shared<Watched>(*this, caller, room, author, method,
                                          // Shared with look() while that ends it.
                                          std::move(end));
  const MutexLock lock(mutex_);
  std::optional<Refusal> refusal = judge_again(stream->caller, room, method);
  if (!refusal && stream->caller.role != caller.role)
    refusal = Refusal{"role", true, changed_role(stream->caller.role)};
  if (!refusal && author) refusal = judge_author(caller, room, author);
  if (refusal) return tl::unexpected(std::move(*refusal));
  streams_.push_back(stream);
  return std::shared_ptr<OpenStream>(stream);
}

Role Authorizer::role_in(const Caller& caller, const std::string& room) const {
  const MutexLock lock(mutex_);
  return access_list_.role(caller.user, room, caller.ticket_role);
}

AuthorizerCounts Authorizer::counts() const {
  const MutexLock lock(mutex_);
  AuthorizerCounts counts = counts_;
  counts.streams = streams_.size();
  return counts;
}

Result<bool> Authorizer::read_authorities() {
  Result<std::string> certificates = read_all(folder_ / "ca.pem");
  if (!certificates) return tl::unexpected(certificates.error());
  const auto known = [&] {
    const MutexLock lock(mutex_);
    return authorities_;
  }();
  Authorities now{.certificates = std::move(*certificates), .revocation_lists = {}};
  if (std::filesystem::exists(folder_ / "crl.pem")) {
    Result<std::string> lists = read_all(folder_ / "crl.pem");
    if (!lists) return tl::unexpected(lists.error());
    now.revocation_lists = std::move(*lists);
  } else if (known && !known->revocation_lists.empty()) {
    return failure(ErrorCode::not_found, (folder_ / "crl.pem").string() + " is gone; its last content holds on");
  }
  if (known && *known == now) return false;
  const Result<std::set<std::string>> serials = listed_serials(now);
  if (!serials)
    return failure(ErrorCode::invalid_input, (folder_ / "ca.pem").string() + " and crl.pem: " +
                                                 serials.error().message + "; make them with deploy/certs");
  const MutexLock lock(mutex_);
  authorities_ = std::make_shared<const Authorities>(std::move(now));  // shared with handshakes in progress
  listed_serials_ = *serials;
  checked_.clear();
  return true;
}

Result<bool> Authorizer::read_ticket_keys() {
  const std::filesystem::path file = folder_ / "tickets.pub";
  const Result<std::string> text = read_all(file);
  if (!text) return tl::unexpected(text.error());
  Result<std::vector<TicketCheckKey>> keys = parse_check_keys(*text);
  if (!keys) return failure(ErrorCode::invalid_input, file.string() + ": " + keys.error().message);
  const MutexLock lock(mutex_);
  if (*keys == ticket_keys_) return false;
  ticket_keys_ = std::move(*keys);
  tickets_.clear();
  return true;
}

// A slow disk delays no call: files are read first, and only the result is stored under the lock that calls take.
void Authorizer::refresh() {
  const MutexLock reading(reading_);
  const auto report = [](std::string_view what, const Result<bool>& read, std::string& logged) {
    const std::string fault = read ? std::string() : read.error().message;
    if (!fault.empty() && fault != logged) log::error(what, {{"fault", fault}});
    logged = fault;
  };
  const Result<bool> list = access_.refresh();
  bool is_revocation = false;
  if (list && *list) {
    log::info("access list", {{"entries", access_.list().size()}});
    const MutexLock lock(mutex_);
    is_revocation = !access_.list().revokes_as(access_list_);
    access_list_ = access_.list();
  }
  report("access list", list, access_fault_);
  const Result<bool> authorities = read_authorities();
  if (authorities && *authorities) {
    const MutexLock lock(mutex_);
    log::info("authorities", {{"revoked_certificates", listed_serials_.size()}});
  }
  report("authorities", authorities, authorities_fault_);
  const Result<bool> keys = read_ticket_keys();
  if (keys && *keys) {
    const MutexLock lock(mutex_);
    log::info("ticket keys", {{"keys", ticket_keys_.size()}});
  }
  report("ticket keys were not read, and those before count on", keys, keys_fault_);
  // A changed role alone closes no connection, since this would also close connections before their first call.
  if (!is_revocation && !(authorities && *authorities)) return;
  const MutexLock lock(mutex_);
  revoked_at_ = std::chrono::steady_clock::now();
}

void Authorizer::close_revoked() {
  const MutexLock lock(mutex_);
  if (!connections_ || !revoked_at_) return;
  // A connection without a call may use a certificate that is revoked now. A new one gets time for its first call. One
  // that came after the revocation was judged by the new list.
  const bool is_over = std::chrono::steady_clock::now() - *revoked_at_ >= kFirstCall;
  const std::size_t closed = connections_->close_if([&](const Connection& one) OSTEON_REQUIRES(mutex_) {
    return one.serial.empty() ? is_over && one.accepted <= *revoked_at_ : revoked(one.serial, one.user, {}).has_value();
  });
  if (is_over) revoked_at_.reset();
  if (closed > 0)
    log::info("connections closed", {{"of", "revoked certificates and before a first call"}, {"count", closed}});
}

void Authorizer::look() {
  std::vector<std::pair<std::shared_ptr<Watched>, Refusal>> ending;
  std::vector<std::shared_ptr<Watched>> held;  // destroyed without the lock, since their destructors take it
  // Closes connections one check after their streams end, so that the clients still receive the reason.
  close_revoked();
  refresh();
  {
    const MutexLock lock(mutex_);
    for (const std::weak_ptr<Watched>& weak : streams_) {
      std::shared_ptr<Watched> stream = weak.lock();
      if (!stream || stream->ended()) {
        held.push_back(std::move(stream));
        continue;
      }
      const Role before = stream->caller.role;
      std::optional<Refusal> refusal = judge_again(stream->caller, stream->room, stream->method);
      // The room knows the role with which somebody joined.
      if (!refusal && stream->caller.role != before) refusal = Refusal{"role", true, changed_role(stream->caller.role)};
      if (refusal) {
        stream->set_role(Role::none);
        ++counts_.ended;
        ending.emplace_back(stream, std::move(*refusal));
      }
      held.push_back(std::move(stream));
    }
  }
  for (const auto& [stream, why] : ending) {
    refusals_.count(why.reason);
    log::warn("stream ended", {{"who", stream->caller.user}, {"reason", why.reason}, {"said", why.sentence}});
    if (trail_)
      trail_->record(
          {.who = {stream->caller.user, stream->caller.serial, stream->caller.ticket_id, stream->caller.address},
           .action = std::string(call_name(stream->method)),
           .object = stream->room,
           .result = kRefused,
           .detail = "ended: " + std::string(why.reason)});
    stream->end(why);
  }
}

void Authorizer::run() {
  MutexLock lock(mutex_);
  while (!end_) {
    lock.unlock();
    look();
    lock.lock();
    wake_.wait_for(lock, kLookEvery, [this]() OSTEON_REQUIRES(mutex_) { return end_; });
  }
}

}  // namespace osteon
