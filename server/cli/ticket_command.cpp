#include "server/cli/ticket_command.hpp"

#include <CLI/CLI.hpp>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "common/access/ticket.hpp"
#include "common/runtime/files.hpp"
#include "common/runtime/number_option.hpp"
#include "common/runtime/secret_file.hpp"

namespace osteon {
namespace {

struct TicketArguments {
  std::filesystem::path key;
  std::string room, user, role;
  double hours = 0;
};

Result<void> make_ticket(const TicketArguments& given) {
  const Result<std::string> text = read_file(given.key);
  if (!text) return tl::unexpected(text.error());
  if (const auto why = who_else_reads(given.key)) std::fprintf(stderr, "warning: %s\n", why->c_str());
  const Result<TicketKey> key = parse_ticket_key(*text);
  if (!key) return failure(key.error().code, given.key.string() + ": " + key.error().message);
  const auto role = parse_role(given.role);
  if (!role)
    return failure(ErrorCode::invalid_input,
                   "--role " + given.role + " is none of observer, trainee, collaborator, instructor, operator");
  const auto now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
  const auto good_for =
      std::chrono::ceil<std::chrono::seconds>(std::chrono::duration<double, std::ratio<3600>>(given.hours));
  const Result<Ticket> ticket = make_ticket(given.room, given.user, *role, now + good_for);
  if (!ticket) return tl::unexpected(ticket.error());
  std::printf("%s\n", sign_ticket(*ticket, *key).c_str());
  // Printed beside the ticket: by this number it can be revoked.
  std::fprintf(stderr, "ticket %s: %s, %s in %s, for %g hours\n", to_hex(ticket->id).c_str(), ticket->user.c_str(),
               given.role.c_str(), given.room == kAnyRoom ? "every room" : given.room.c_str(), given.hours);
  if (good_for > kLongTicket)
    std::fprintf(
        stderr,
        "warning: this ticket is good for more than %d hours, and a server with --most-ticket-hours may refuse it; "
        "give fewer --hours\n",
        static_cast<int>(kLongTicket.count()));
  return {};
}

}  // namespace

void add_ticket_command(CLI::App& app, std::function<Result<void>()>& chosen) {
  const auto given = std::make_shared<TicketArguments>();  // shared by the options and the function that runs
  CLI::App* ticket =
      app.add_subcommand("ticket", "Signs a ticket, with which a person with a certificate may enter a room");
  ticket
      ->add_option("--key", given->key, "Secret key of the authority: tickets.key, as deploy/certs authority makes it")
      ->required();
  ticket->add_option("--room", given->room, "Name of the room, * for every room")->required();
  ticket->add_option("--user", given->user, "Whose: the name in the person's certificate")->required();
  ticket->add_option("--role", given->role, "observer, trainee, collaborator, instructor or operator")->required();
  ticket->add_option("--hours", given->hours, "How long it is good")->required()->check(number_in(0.001, 87600.0));
  ticket->callback([&chosen, given] { chosen = [given] { return make_ticket(*given); }; });
}

}  // namespace osteon
