// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include <libpq-fe.h>

#include "fleet/database.h"
#include "truetriad/base/result.h"

namespace truetriad::fleet {

/// The functions of libpq that are used, by their names without PQ. libpq is loaded only for a
/// store on PostgreSQL, since it loads Kerberos, LDAP and more, which nothing else here needs.
struct Libpq {
  decltype(&PQclear) clear;
  decltype(&PQcmdTuples) cmdTuples;
  decltype(&PQconnectdb) connectdb;
  decltype(&PQconninfoFree) conninfoFree;
  decltype(&PQconninfoParse) conninfoParse;
  decltype(&PQerrorMessage) errorMessage;
  decltype(&PQexec) exec;
  decltype(&PQexecParams) execParams;
  decltype(&PQfinish) finish;
  decltype(&PQfname) fname;
  decltype(&PQftype) ftype;
  decltype(&PQgetisnull) getisnull;
  decltype(&PQgetvalue) getvalue;
  decltype(&PQnfields) nfields;
  decltype(&PQntuples) ntuples;
  decltype(&PQresultErrorField) resultErrorField;
  decltype(&PQresultStatus) resultStatus;
  decltype(&PQstatus) status;
};
/// Error (usage): libpq is not installed.
Result<const Libpq*> LoadedLibpq();

/// OpenPostgres of database.h through `libpq`, which must outlive the result.
Result<std::unique_ptr<Database>> OpenPostgres(const Libpq& libpq,
                                               const std::string& url,
                                               Access access,
                                               double patience_s);

}  // namespace truetriad::fleet
