import sys,collections,re
inc=collections.Counter();tot=0
stack=[]
def done():
    global tot
    if stack:
        tot+=1
        for f in set(stack): inc[f]+=1
for line in open(sys.argv[1],errors='replace'):
    line=line.rstrip('\n')
    if not line.strip(): done(); stack=[]; continue
    if line[0] in ' \t':
        m=re.match(r'\s+[0-9a-f]+ (.*?)(\+0x[0-9a-f]+)? \(',line)
        if m:
            n=re.sub(r'::h[0-9a-f]{16}','',m.group(1)); stack.append(n)
done()
for f,c in inc.most_common(int(sys.argv[2])): print(f"{100*c/tot:5.1f}% {f[:150]}")
