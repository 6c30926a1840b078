# dlod.yaml.5 from config/dlod.yaml: each key with its full name, and the comments above it.
function escaped(text) { gsub(/\\/, "\\e", text); gsub(/-/, "\\-", text); return text }
FNR <= 2 && /^#/ { next }
/^ *#/ {
    sub(/^ *# ?/, "")
    # Unit, default and range are lines of their own.
    if (comment != "") comment = comment (/^(Unit|Default): / ? "\n.br\n" : "\n")
    comment = comment escaped($0)
    next
}
/^ *[a-z_0-9]+:/ {
    match($0, /^ */)
    depth = RLENGTH / 4
    line = substr($0, RLENGTH + 1)
    colon = index(line, ":")
    path[depth] = substr(line, 1, colon - 1)
    key = path[0]
    for (i = 1; i <= depth; i++) key = key "." path[i]
    if (colon == length(line)) {
        print ".SS " escaped(key)
        print comment
    } else {
        print ".TP"
        print "\\fB" escaped(key) "\\fR"
        print comment
    }
}
/^ *[a-z_0-9]+:/ || /^ *$/ { comment = "" }
